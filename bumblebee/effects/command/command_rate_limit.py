"""A drive that follows its targets no faster than it may."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bumblebee.effects.kind import INF, Given, Kind, Parameter
from bumblebee.effects.places import OnJoint, Step


class CommandRateLimit(Kind):
    """dy/dt = rate sgn(u - y) of the set-point y until it is there, see `effects.setpoints`."""

    rank = 260
    parameters = (Parameter("rate", "rad/s", 1e-3, INF),)
    native, absent = False, INF
    beside = ("command_filter",)
    drive = "position"
    experiment = "command steps of several sizes: a limited rate takes longer for a larger one"
    inverse = True
    law = "its rate moves the target once a command, which is called slewed(r, T) - u"
    not_undone = "the drive follows no target faster"

    def hook(self, making: Any, effect: Given) -> None:
        making.setpoint("target_rate", effect)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        if min(on.target_rate, on.target_turn) > 0:
            for share in on.rules.drive.target_rate:
                yield Step((1.0 / (share * on.target_rate),))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [along.commanded(c)]
