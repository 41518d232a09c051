"""Motions that are on the robot already: readers and writers of the formats that the field uses."""
