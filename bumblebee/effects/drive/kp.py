"""A servo's gain on the error of its position, as a factor on the declared one."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.law import TARGET, Law, fixed
from bumblebee.effects.mjcf import scale_gains, scale_gains_in_place
from bumblebee.effects.places import OnJoint, Spot, Step
from bumblebee.effects.words import inverse_of


class Kp(Kind):
    """(factor - 1) kp (u - q)."""

    rank = 180
    parameters = (Parameter("factor", "", 1e-3, 20.0),)
    absent = 1.0
    drive = "position"
    standard = "drive"
    experiment = "vary kp and hold a known load"
    law = Law(fixed((("u - q",), TARGET, 1)), "", driven=True)

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        scale_gains(spec, place, values[0], 1.0)

    def write(self, spot: Spot, *values: float) -> None:
        scale_gains_in_place(spot, values[0], 1.0)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.rules.drive.gain,))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [c.step[0] * (along.torque - along.damping * along.v)]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        numbers = inverse_of(effect)
        draft.kp_factor[columns] *= effect.value()
        return "the kp sent is divided by it", numbers
