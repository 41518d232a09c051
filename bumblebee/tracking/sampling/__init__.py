"""Which motion an episode follows, and from which frame."""
