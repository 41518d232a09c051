"""Captions of a motion: those of HumanML3D, of the user, and of file names, kept apart."""
