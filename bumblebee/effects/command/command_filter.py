"""A servo's input filter."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.places import OnJoint, OnRobot, Step


class CommandFilter(Kind):
    """dy/dt = (u - y) / time of the set-point y, see `effects.setpoints`."""

    rank = 130
    parameters = (Parameter("time", "s", 0.0, 0.5),)
    whole = True
    native, absent = False, 0.0
    drive = "any"
    experiment = "command a step and log the servo's own set-point, or its position at 500 Hz"
    law = "no term has a filtered target"
    not_undone = "a target that undoes it runs ahead of the reference by its speed, with the noise of that"

    def hook(self, making: Any, effect: Given) -> None:
        making.setpoint("filter_time", effect)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.rules.drive.time,))

    def steps_together(self, on: OnRobot) -> Iterator[Step]:
        yield Step((on.rules.drive.time,))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [along.commanded(c)]
