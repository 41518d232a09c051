"""Every number that the diagnosis decides by, with its reason: a file a room, a frozen dataclass a concept.

They travel with what they decide on (`Problem.thresholds`, an argument elsewhere) and are set in
`DiagnosisConfig.thresholds`. Those of the search as a whole (level, trials, patience) are in `SearchConfig`.
"""

from dataclasses import dataclass, field

from bumblebee.diagnosis.thresholds.estimation import EstimationThresholds

__all__ = ["Thresholds"]


@dataclass(frozen=True)
class Thresholds:
    """The thresholds of all rooms."""

    estimation: EstimationThresholds = field(default_factory=EstimationThresholds)
