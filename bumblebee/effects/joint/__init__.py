"""What sits on a joint beside friction."""
