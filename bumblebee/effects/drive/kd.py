"""A servo's damping, as a factor on the declared one."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.mjcf import scale_gains, scale_gains_in_place
from bumblebee.effects.places import OnJoint, Spot, Step
from bumblebee.effects.words import inverse_of


class Kd(Kind):
    """-(factor - 1) kd v."""

    rank = 190
    parameters = (Parameter("factor", "", 0.0, 50.0),)
    absent = 1.0
    drive = "position"
    experiment = "vary kd: an error of the gain grows with it, friction does not"
    usual = "joint"
    law = "its torque is that of v, which is called viscous_friction"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        scale_gains(spec, place, 1.0, values[0])

    def write(self, spot: Spot, *values: float) -> None:
        scale_gains_in_place(spot, 1.0, values[0])

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.rules.drive.gain,))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [c.step[0] * (along.damping * along.v)]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        numbers = inverse_of(effect)
        draft.kd_factor[columns] *= effect.value()
        return "the kd sent is divided by it", numbers
