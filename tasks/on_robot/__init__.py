"""The robot as stages reach it, and what a round leaves for later stages."""
