"""Dry friction, MuJoCo's frictionloss: against the motion, of the same size at every speed."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.hinges import joint_of
from bumblebee.effects.kind import INF, Given, Kind, Parameter
from bumblebee.effects.law import VELOCITY, Law, fixed
from bumblebee.effects.mjcf import stick, stick_in_place
from bumblebee.effects.places import OnJoint, Spot, Step
from bumblebee.effects.words import fed_along, spread


class CoulombFriction(Kind):
    """-frictionloss sgn(v)."""

    rank = 10
    parameters = (Parameter("frictionloss", "N m", 0.0, INF),)
    standard = "joint"
    experiment = "move at several speeds under several loads"
    usual, named_first = "joint", 1
    law = Law(fixed((("friction(1)",), VELOCITY, 1)), "friction(", lambda now, was: {"friction(1)": now[0] - was[0]})

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        stick(spec, place)
        joint_of(spec, place).frictionloss = values[0]

    def write(self, spot: Spot, *values: float) -> None:
        stick_in_place(spot)
        spot.model.dof_frictionloss[spot.dof] = values[0]

    def declared(self, spot: Spot) -> Sequence[float]:
        return (spot.model.dof_frictionloss[spot.dof],)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.torque,))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [c.step[0] * -along.sign]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        excess = effect.value() - draft.robot.model.dof_frictionloss[draft.robot.dofs[columns]]
        draft.arrays["dry"][columns] = excess
        return fed_along(draft), spread(draft.limits.friction_share * excess, "N m")
