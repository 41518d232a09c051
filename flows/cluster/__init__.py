"""Stages on the machines of a lab's Ray cluster."""
