"""Numbers that the report goes by."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ReportThresholds:
    """All of them."""
