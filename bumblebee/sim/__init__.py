"""Simulation: one small interface, its engines, and the effects that a real robot adds to the declared model."""
