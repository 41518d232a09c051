"""Sensors that report something else."""
