"""Numbers that the gap report goes by."""

from dataclasses import dataclass


@dataclass(frozen=True)
class GapThresholds:
    """All of them."""
