"""Sensitivities: the change of the residuals by a small change of each candidate."""

from bumblebee.diagnosis.sensitivities.columns import Answered, Columns, pulse_sizes, screen
from bumblebee.diagnosis.sensitivities.impulse_responses import Answers, Path, answers_of

__all__ = [
    "Answered",
    "Answers",
    "Columns",
    "Path",
    "answers_of",
    "pulse_sizes",
    "screen",
]
