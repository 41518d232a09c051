"""Every number that the diagnosis decides by, with its reason: a file a room, a frozen dataclass a concept.

They travel with what they decide on (`Problem.thresholds`, an argument elsewhere) and are set in
`DiagnosisConfig.thresholds`. Those of the search as a whole (level, trials, patience) are in `SearchConfig`.
"""

from dataclasses import dataclass, field

from bumblebee.diagnosis.thresholds.candidates import CandidateThresholds
from bumblebee.diagnosis.thresholds.comparison import ComparisonThresholds
from bumblebee.diagnosis.thresholds.dataset import DatasetThresholds
from bumblebee.diagnosis.thresholds.discrepancy import DiscrepancyThresholds
from bumblebee.diagnosis.thresholds.estimation import EstimationThresholds
from bumblebee.diagnosis.thresholds.gap import GapThresholds
from bumblebee.diagnosis.thresholds.plan import PlanThresholds
from bumblebee.diagnosis.thresholds.report import ReportThresholds
from bumblebee.diagnosis.thresholds.residuals import ResidualThresholds
from bumblebee.diagnosis.thresholds.selection import SelectionThresholds
from bumblebee.diagnosis.thresholds.sensitivities import SensitivityThresholds
from bumblebee.diagnosis.thresholds.simulation import SimulationThresholds

__all__ = ["Thresholds"]


@dataclass(frozen=True)
class Thresholds:
    """The thresholds of all rooms."""

    simulation: SimulationThresholds = field(default_factory=SimulationThresholds)
    dataset: DatasetThresholds = field(default_factory=DatasetThresholds)
    candidates: CandidateThresholds = field(default_factory=CandidateThresholds)
    residuals: ResidualThresholds = field(default_factory=ResidualThresholds)
    sensitivities: SensitivityThresholds = field(default_factory=SensitivityThresholds)
    estimation: EstimationThresholds = field(default_factory=EstimationThresholds)
    comparison: ComparisonThresholds = field(default_factory=ComparisonThresholds)
    selection: SelectionThresholds = field(default_factory=SelectionThresholds)
    discrepancy: DiscrepancyThresholds = field(default_factory=DiscrepancyThresholds)
    gap: GapThresholds = field(default_factory=GapThresholds)
    report: ReportThresholds = field(default_factory=ReportThresholds)
    plan: PlanThresholds = field(default_factory=PlanThresholds)
