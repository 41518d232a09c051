"""A drive that gives more or less torque than it is asked for: its gains together, as a factor on the declared ones."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.law import TORQUE, Law, fixed
from bumblebee.effects.mjcf import scale_gains, scale_gains_in_place
from bumblebee.effects.places import OnJoint, Spot, Step
from bumblebee.effects.words import inverse_of


class MotorStrength(Kind):
    """(factor - 1) times the servo's torque."""

    rank = 170
    parameters = (Parameter("factor", "", 1e-3, 20.0),)
    absent = 1.0
    drive = "scaled"
    standard = "drive"
    experiment = "hold a known load at rest, and vary kp and kd together"
    usual, named_first = "joint", 4
    law = Law(fixed((("tau",), TORQUE, 1)), "", driven=True)

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        scale_gains(spec, place, values[0], values[0])

    def write(self, spot: Spot, *values: float) -> None:
        scale_gains_in_place(spot, values[0], values[0])

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.rules.drive.gain,))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [c.step[0] * along.torque]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        numbers = inverse_of(effect)
        draft.arrays["strength"][columns] *= effect.value()
        return "gains and torque sent are divided by it", numbers
