"""The checks of the contract on a measured rollout, their limits, and what they say."""

from bumblebee.measured.checks.base import check_base
from bumblebee.measured.checks.finding import Finding
from bumblebee.measured.checks.magnitude import beyond
from bumblebee.measured.checks.rollout import check_rollout
from bumblebee.measured.checks.thresholds import Thresholds
from bumblebee.measured.checks.units import at_joint, driven_joints, servo_gains
from bumblebee.measured.checks.view import View

__all__ = [
    "Finding",
    "Thresholds",
    "View",
    "at_joint",
    "beyond",
    "check_base",
    "check_rollout",
    "driven_joints",
    "servo_gains",
]
