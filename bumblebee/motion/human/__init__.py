"""Motions of people: skeletons of mocap files brought to one set of landmarks."""
