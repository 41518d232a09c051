"""A drive whose torque follows what its servo asks for, with a time constant."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.places import OnJoint, OnRobot, Step
from bumblebee.effects.words import milliseconds


class TorqueLag(Kind):
    """A first-order lag of the servo's torque."""

    rank = 200
    parameters = (Parameter("time", "s", 0.0, 0.1),)
    whole = True
    native, absent = False, 0.0
    drive = "position"
    experiment = "command steps and log the torque at 500 Hz"
    column, fine_steps = "late", True
    law = "no term has an older torque"

    def hook(self, making: Any, effect: Given) -> None:
        making.first("torque_lag", effect)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.rules.drive.time,))

    def steps_together(self, on: OnRobot) -> Iterator[Step]:
        yield Step((on.rules.drive.time,))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [along.late("torque_lag", c.start[0])]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        draft.arrays["torque_lag"][columns] = effect.value()
        done = (
            "feed-forward torque is sent that much earlier; the drive's loop takes up its lag in what follows a target"
        )
        return done, milliseconds(effect)
