"""Differences from world to world in training: physics, ground, pushes."""
