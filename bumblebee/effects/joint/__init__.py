"""Inertia, springs and ripple on a joint."""
