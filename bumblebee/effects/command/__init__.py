"""What becomes of a command before the servo follows it."""
