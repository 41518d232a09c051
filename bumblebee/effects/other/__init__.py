"""What has no name of its own."""
