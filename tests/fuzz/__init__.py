"""Fuzzing that stays: every reader and configuration against damaged and hostile input, for a few seconds a file."""
