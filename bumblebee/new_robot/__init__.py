"""A robot's first folder from its MJCF, and whether a folder describes a robot that can be trained."""
