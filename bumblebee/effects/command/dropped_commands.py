"""Commands that never arrive; the drive holds the last one."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.places import OnJoint, OnRobot, Step


class DroppedCommands(Kind):
    """A share of the commands, each lost by itself; of all joints together where it is said of the whole robot.

    Found by the likelihood over all patterns of losses.
    """

    rank = 140
    parameters = (Parameter("share", "", 0.0, 0.9),)
    whole = True
    native, absent = False, 0.0
    drive = "any"
    experiment = "log the commands as the drive receives them"
    law = "which commands were lost is not in a log"
    not_undone = "that a command is lost is not known when it is sent"

    def hook(self, making: Any, effect: Given) -> None:
        making.drop(effect)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.rules.drive.dropped,))

    def steps_together(self, on: OnRobot) -> Iterator[Step]:
        yield Step((on.rules.drive.dropped,))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [along.commanded(c)]
