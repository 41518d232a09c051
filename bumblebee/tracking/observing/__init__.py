"""Observations of a policy: terms, groups, history, and the errors of sensors."""
