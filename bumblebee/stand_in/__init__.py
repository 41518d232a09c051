"""The stand-in robot: undeclared effects in a process of its own, which shares nothing with the diagnosis."""
