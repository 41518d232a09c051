"""Motions of the G1: read from every format of the field, resampled, checked, filtered and stored."""
