"""Readings that are old when log and servo get them."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.places import OnJoint, OnRobot, Step
from bumblebee.effects.words import milliseconds


class EncoderDelay(Kind):
    """The servo's torque at the position and speed of `delay` ago, which the log has too."""

    rank = 210
    parameters = (Parameter("delay", "s", 0.0, 0.05),)
    whole = True
    native, absent = False, 0.0
    drive = "position"
    experiment = "film the joint, or log a second encoder"
    column, fine_steps = "late", True
    law = "no term has an older reading"

    def hook(self, making: Any, effect: Given) -> None:
        making.first("encoder_delay", effect)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.rules.drive.time,))

    def steps_together(self, on: OnRobot) -> Iterator[Step]:
        yield Step((on.rules.drive.time,))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [along.late("encoder_delay", c.start[0])]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        draft.arrays["encoder_delay"][columns] = effect.value()
        done = (
            "readings are carried on by their velocity, the drive is told where the joint was; its damping stays late"
        )
        return done, milliseconds(effect)
