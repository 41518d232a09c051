"""Numbers that two models are compared by."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ComparisonThresholds:
    """All of them."""
