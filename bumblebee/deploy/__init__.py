"""Deployment: exported policies, the 50 Hz step from sensors to joint targets, the stand-in robot."""
