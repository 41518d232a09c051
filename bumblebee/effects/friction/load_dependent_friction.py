"""Friction of a gear, a share of the torque that goes through it."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.law import TORQUE, Law, fixed
from bumblebee.effects.mjcf import stick, stick_in_place
from bumblebee.effects.places import OnJoint, Spot, Step
from bumblebee.effects.words import fed_along


class LoadDependentFriction(Kind):
    """-(coefficient + difference / 2 sgn(v)) abs(servo torque) sgn(v): the mean of both directions, and their gap."""

    rank = 110
    parameters = (Parameter("coefficient", "", 0.0, 2.0), Parameter("difference", "", -4.0, 4.0, 0.0))
    native, absent = False, 0.0
    drive = "any"
    standard = "drive"
    experiment = "move at the same speed under two loads"
    law = Law(
        fixed((("friction(abs(tau))",), TORQUE, 2)),
        "friction(",
        lambda now, was: {"friction(abs(tau))": now[0]},
        driven=True,
    )

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        stick(spec, place)

    def write(self, spot: Spot, *values: float) -> None:
        stick_in_place(spot)

    def hook(self, making: Any, effect: Given) -> None:
        making.rows("load_friction", effect)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.rules.drive.load, 0.0))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        load, sign = np.abs(along.torque), along.sign
        return [-c.step[0] * load * sign, -0.5 * c.step[1] * load * sign**2][: len(c.free)]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        draft.arrays["load_friction"][columns] = effect.value()
        coefficient, difference = effect.values()
        mean = ", the mean of both directions" if difference else ""
        size = draft.limits.friction_share * coefficient
        return f"{fed_along(draft)}, of the torque that the drive reports{mean}", f"{size:.3g} of it"
