"""What lies between a motor and its link."""
