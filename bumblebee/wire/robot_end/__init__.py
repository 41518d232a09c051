"""The simulated robot's end of the wire."""
