"""A drive that plans its way to each target."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bumblebee.effects.kind import INF, Given, Kind, Parameter
from bumblebee.effects.places import OnJoint, Step
from bumblebee.effects.setpoints import NO_SPEED_LIMIT


class CommandProfile(Kind):
    """To rest at the target in the shortest time within a speed and an acceleration, see `effects.setpoints`.

    Without a limit of speed the acceleration alone is given.
    """

    rank = 270
    parameters = (
        Parameter("acceleration", "rad/s^2", 1e-2, INF),
        Parameter("speed", "rad/s", 1e-3, NO_SPEED_LIMIT, NO_SPEED_LIMIT),
    )
    native, absent = False, (INF, NO_SPEED_LIMIT)
    beside = ("command_filter", "command_rate_limit")
    drive = "position"
    experiment = "command steps of several sizes: an acceleration that is limited takes longer by the root of the size"
    inverse = True
    law = "no term has a target of limited acceleration"
    not_undone = "the drive follows no target faster"

    def hook(self, making: Any, effect: Given) -> None:
        making.setpoint("profile", effect)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        if min(on.target_rate, on.target_turn) <= 0:
            return
        for share, fast in on.rules.drive.target_turn:
            speed = fast * on.target_rate
            steps = (1.0 / (share * on.target_turn), speed - NO_SPEED_LIMIT if fast else 0.0)
            yield Step(steps, shape=on.rules.joint.shape * speed)

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [along.commanded(c)]
