"""The base policy that comes with BumbleBee, trained on a GPU; README.md beside it is its card."""

from pathlib import Path

FOLDER = Path(__file__).parent
"""A policy's folder, as `load_policy` reads it."""
