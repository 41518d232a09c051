"""A drive that loses strength as its motor warms up."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bumblebee.effects.drive.strength_drift import FADE_SECONDS
from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.places import OnJoint, Step


class ThermalFade(Kind):
    """-rate int (torque / limit)^2 dt times the servo's torque."""

    rank = 230
    parameters = (Parameter("rate", "1/s", -1.0, 1.0),)
    native, absent = False, 0.0
    drive = "position"
    experiment = "repeat the motion after a pause"
    law = "no term has the motor's heat"
    not_undone = "it depends on the motor's heat, which is not measured"

    def hook(self, making: Any, effect: Given) -> None:
        making.first("thermal", effect)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.rules.drive.fade / max(on.duration, FADE_SECONDS),))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [c.step[0] * (-along.heat * along.torque)]
