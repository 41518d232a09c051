"""Stills and films of motions, rendered or painted."""
