"""Transmission between a motor and its link."""
