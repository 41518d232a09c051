"""Numbers that the columns of all candidates go by."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SensitivityThresholds:
    """All of them."""
