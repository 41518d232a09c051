"""Sensitivities: the change of the residuals by a small change of each candidate."""

from bumblebee.diagnosis.sensitivities.columns import Answered, Columns, pulse_sizes, screen
from bumblebee.diagnosis.sensitivities.ground import basis_of, without
from bumblebee.diagnosis.sensitivities.impulse_responses import Answers, Path, answers_of
from bumblebee.diagnosis.sensitivities.lacking_torque import LackingTorque, lacking_torque

__all__ = [
    "Answered",
    "Answers",
    "Columns",
    "LackingTorque",
    "Path",
    "answers_of",
    "basis_of",
    "lacking_torque",
    "pulse_sizes",
    "screen",
    "without",
]
