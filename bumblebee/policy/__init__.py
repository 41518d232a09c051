"""Policies as they are deployed: the exported file, its 50 Hz step from sensors to targets, trials of it."""
