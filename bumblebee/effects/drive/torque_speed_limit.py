"""The speed at which a drive has no torque left, as by back-EMF."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bumblebee.effects.drive.torque_limit import TorqueLimit
from bumblebee.effects.kind import INF, Given, Kind, Parameter
from bumblebee.effects.places import OnJoint, Step


class TorqueSpeedLimit(Kind):
    """A torque that drives the motion within limit (1 - abs(v) / speed); one that brakes keeps the full limit.

    With a stated supply voltage it is the speed at the nominal one.
    """

    rank = 250
    parameters = (Parameter("speed", "rad/s", 0.05, INF),)
    native, absent = False, INF
    drive = "position"
    experiment = "move fast without load and slowly under load"
    fine_steps = saturation = inverse = True
    law = "no term is a limit that moves with the speed"
    not_undone = "a torque that the motor does not have at speed cannot be asked of it"

    def hook(self, making: Any, effect: Given) -> None:
        making.first("speed_limit", effect)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        if np.isfinite(TorqueLimit().declared(on.spot)[0]):
            for factor in on.rules.drive.speed_limit:
                yield Step((1.0 / (factor * on.fastest),))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        torque, v = along.torque, along.v
        left = along.limit * np.clip(1.0 - np.abs(v) * c.step[0] / along.supply, 0.0, 1.0)
        return [np.where(torque * v > 0, np.clip(torque, -left, left) - torque, 0.0)]
