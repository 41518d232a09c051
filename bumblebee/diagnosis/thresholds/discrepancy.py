"""Numbers that what lies beyond the catalogue is judged by."""

from dataclasses import dataclass


@dataclass(frozen=True)
class DiscrepancyThresholds:
    """All of them."""
