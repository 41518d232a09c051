"""The logs as they are used: checked and smoothed, divided into fitted and held-out rollouts, with their noise."""

from bumblebee.diagnosis.dataset.held_out import read_held_out, varied
from bumblebee.diagnosis.dataset.informative_split import informative, window_errors
from bumblebee.diagnosis.dataset.matched import refuse_unmatched
from bumblebee.diagnosis.dataset.session import JUDGED_TWICE, Session, make_session, open_session
from bumblebee.diagnosis.dataset.split import motion_names
from bumblebee.diagnosis.dataset.time_steps import step_for, steps_of

__all__ = [
    "JUDGED_TWICE",
    "Session",
    "informative",
    "make_session",
    "motion_names",
    "open_session",
    "read_held_out",
    "refuse_unmatched",
    "step_for",
    "steps_of",
    "varied",
    "window_errors",
]
