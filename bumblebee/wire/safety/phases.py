"""Phases of a run: hang, stand up, hold, blend, run, damp, off; and how long each takes."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated

import numpy as np

from bumblebee.ranges import Range, Ranged
from bumblebee.wire.messages import Mode
from bumblebee.wire.safety.limits import Seconds


class Phase(IntEnum):
    """Phase of a run, in order."""

    WAIT = 0
    """No torque, until the robot listens to us and the operator says go."""
    RISE = 1
    """From where the joints are to the clip's first frame, slowly, gains growing; the robot hangs."""
    READY = 2
    """The first frame is held until the operator says go again."""
    BLEND = 3
    """From the held frame to the policy on its first frame; the robot still hangs."""
    RUN = 4
    """The policy follows the clip, and then stands on its last frame until the key is let go."""
    DAMP = 5
    """kd alone."""
    OFF = 6
    """No torque; the run is over."""


MODES = {
    Phase.WAIT: Mode.OFF,
    Phase.RISE: Mode.HOLD,
    Phase.READY: Mode.HOLD,
    Phase.BLEND: Mode.HOLD,
    Phase.RUN: Mode.RUN,
    Phase.DAMP: Mode.DAMP,
    Phase.OFF: Mode.OFF,
}
"""Mode that the drives are told in each phase."""


@dataclass(frozen=True)
class Ramps(Ranged):
    """How slowly a run goes in and out."""

    rise_speed: Annotated[float, Range(above=0, most=5)] = 0.4
    """Fastest joint while standing up [rad/s]."""
    rise_least: Seconds = 3.0
    """Shortest time to stand up [s]."""
    soften: Seconds = 1.0
    """Time in which the gains grow from 0 [s]."""
    ready: Seconds = 1.0
    """Shortest time at the first frame [s]."""
    blend: Seconds = 2.0
    """Time from the held frame to the policy [s]."""
    stand: Seconds = 1.0
    """Time on the last frame, where nobody holds a key [s]."""
    damp: Seconds = 3.0
    """Time of damping before the torque goes off [s]."""


def smooth(share: float) -> float:
    """From 0 to 1 as `share` does, with no speed at either end."""
    share = min(max(share, 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


def rise_time(begin: np.ndarray, end: np.ndarray, ramps: Ramps) -> float:
    """Time [s] from joint angles (J,) to others [rad], with the fastest joint at `rise_speed` in the middle."""
    return max(ramps.rise_least, 1.5 * float(np.abs(end - begin).max()) / ramps.rise_speed)
