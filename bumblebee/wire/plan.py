"""What a run is given before it begins, and what the policy's worker says first."""

from dataclasses import dataclass, field

import numpy as np

from bumblebee.wire.limits import Limits
from bumblebee.wire.phases import Ramps

ORDER_HZ = 200
"""Orders to the drives a second."""


@dataclass(frozen=True)
class Plan:
    """What the guard was told after everything had been checked."""

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
    unattended: bool = False
    """Nobody holds a key: with a simulated robot alone."""
    limits: Limits = field(default_factory=Limits)
    ramps: Ramps = field(default_factory=Ramps)
