"""Numbers that the use of the logs goes by."""

from dataclasses import dataclass


@dataclass(frozen=True)
class DatasetThresholds:
    """All of them."""
