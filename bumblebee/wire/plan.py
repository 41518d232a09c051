"""Facts of a run that are fixed before it begins."""

from dataclasses import dataclass, field

import numpy as np

from bumblebee.wire.safety.limits import Limits
from bumblebee.wire.safety.phases import Ramps

ORDER_HZ = 200
"""Orders to the drives a second."""


@dataclass(frozen=True)
class Plan:
    """Orders of the console to the guard, after everything has been checked."""

    controller: int
    """Our number, drawn for this run."""
    robot: int
    """Boot number of the robot that was checked."""
    every: int
    """Orders for each question to the policy."""
    frames: int
    """Control steps of the clip."""
    hold: np.ndarray
    """(J,) targets that carry the first frame [rad]."""
    numbers: tuple[str, ...]
    """Fields of a state that must be numbers, see `intake.numbers_for`."""
    unattended: bool = False
    """Nobody holds a key: with a simulated robot alone."""
    limits: Limits = field(default_factory=Limits)
    ramps: Ramps = field(default_factory=Ramps)
