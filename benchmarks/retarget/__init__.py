"""Retargeted motions measured: sets of motions side by side, and retargeters on the same people."""
