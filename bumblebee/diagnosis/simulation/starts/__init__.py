"""States at a window's start that no sensor reads, from the log before it."""
