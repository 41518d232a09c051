"""Numbers that the candidates go by."""

from dataclasses import dataclass


@dataclass(frozen=True)
class CandidateThresholds:
    """All of them."""
