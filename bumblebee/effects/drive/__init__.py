"""Drives: their gains, their torque and its limits."""
