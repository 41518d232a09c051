"""The policy's end of the wire."""
