"""Drag of grease or wind, the second coefficient of MuJoCo's damping."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.hinges import joint_of
from bumblebee.effects.kind import INF, Given, Kind, Parameter
from bumblebee.effects.law import VELOCITY, Law, fixed
from bumblebee.effects.places import OnJoint, Spot, Step
from bumblebee.effects.words import spread


class QuadraticFriction(Kind):
    """-coefficient v abs(v)."""

    rank = 30
    parameters = (Parameter("coefficient", "N m s^2/rad^2", 0.0, INF),)
    experiment = "turn the unpowered joint at several constant speeds, fast ones among them"
    law = Law(fixed((("v*abs(v)",), VELOCITY, 2)), "v", lambda now, was: {"v*abs(v)": -(now[0] - was[0])})

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        joint = joint_of(spec, place)
        joint.damping = [joint.damping[0], values[0], joint.damping[2]]

    def write(self, spot: Spot, *values: float) -> None:
        spot.model.dof_dampingpoly[spot.dof, 0] = values[0]

    def declared(self, spot: Spot) -> Sequence[float]:
        return (spot.model.dof_dampingpoly[spot.dof, 0],)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.torque / on.speed**2,))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [c.step[0] * (-along.v * np.abs(along.v))]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        excess = effect.value() - draft.robot.model.dof_dampingpoly[draft.robot.dofs[columns], 0]
        draft.terms += [(int(column), -float(more), "v*abs(v)") for column, more in zip(columns, excess, strict=True)]
        return "its torque at the intended velocity is sent against it", spread(excess, "N m s^2/rad^2")
