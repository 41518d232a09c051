"""A drive that loses strength with time."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.law import TIME, Law, fixed
from bumblebee.effects.places import OnJoint, Step

FADE_SECONDS = 1.0
"""Shortest time over which a drive that fades is taken to fade [s]."""


class StrengthDrift(Kind):
    """-rate t times the servo's torque."""

    rank = 220
    parameters = (Parameter("rate", "1/s", -1.0, 1.0),)
    native, absent = False, 0.0
    drive = "position"
    experiment = "repeat the motion after a pause, without one"
    law = Law(fixed((("t*tau",), TIME, 2)), "")
    not_undone = "it depends on how long the robot has run since it was measured"

    def hook(self, making: Any, effect: Given) -> None:
        making.first("drift", effect)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.rules.drive.fade / max(on.duration, FADE_SECONDS),))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [c.step[0] * (-along.clock * along.torque)]
