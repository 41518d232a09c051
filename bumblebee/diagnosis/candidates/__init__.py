"""Which effects the model may lack: every effect of the catalogue in every place, with its size and traits."""

from bumblebee.diagnosis.candidates.candidate import (
    Candidate,
    absent,
    clipped,
    effects_at,
    is_simulated,
    label,
    shortlisted,
    without,
)
from bumblebee.diagnosis.candidates.enumerate import all_candidates, still_joints
from bumblebee.diagnosis.candidates.exclusion import is_chosen, is_like, possible_beside
from bumblebee.diagnosis.candidates.formula import Formula, formula
from bumblebee.diagnosis.candidates.short_term import short_term
from bumblebee.diagnosis.candidates.signal_scales import scales_of
from bumblebee.diagnosis.candidates.traits import (
    ABRUPT,
    IMU_TILT,
    INVERSE,
    JUDGED_ALONE,
    SATURATIONS,
    SHAPED,
    USUAL_OF_BODIES,
    USUAL_OF_ROBOT,
    experiment,
    naming_order,
    rough,
)

__all__ = [
    "ABRUPT",
    "IMU_TILT",
    "INVERSE",
    "JUDGED_ALONE",
    "SATURATIONS",
    "SHAPED",
    "USUAL_OF_BODIES",
    "USUAL_OF_ROBOT",
    "Candidate",
    "Formula",
    "absent",
    "all_candidates",
    "clipped",
    "effects_at",
    "experiment",
    "formula",
    "is_chosen",
    "is_like",
    "is_simulated",
    "label",
    "naming_order",
    "possible_beside",
    "rough",
    "scales_of",
    "short_term",
    "shortlisted",
    "still_joints",
    "without",
]
