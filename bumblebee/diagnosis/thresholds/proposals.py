"""Numbers that the proposals of the search go by."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ProposalThresholds:
    """All of them."""
