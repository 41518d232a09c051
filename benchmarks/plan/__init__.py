"""Planned runs on sealed robots, beside random motions of equal length."""
