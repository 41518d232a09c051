"""Numbers that the search for effects goes by."""

from dataclasses import dataclass, field

from bumblebee.diagnosis.thresholds.proposals import ProposalThresholds


@dataclass(frozen=True)
class SelectionThresholds:
    """All of them."""

    proposals: ProposalThresholds = field(default_factory=ProposalThresholds)
