"""What rubs on a joint."""
