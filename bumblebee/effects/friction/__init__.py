"""Friction on a joint."""
