"""Friction that grows with the speed, MuJoCo's damping."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.hinges import joint_of
from bumblebee.effects.kind import INF, Given, Kind, Parameter
from bumblebee.effects.law import VELOCITY, Law, fixed
from bumblebee.effects.places import OnJoint, Spot, Step
from bumblebee.effects.words import spread


class ViscousFriction(Kind):
    """-damping v."""

    rank = 20
    parameters = (Parameter("damping", "N m s/rad", 0.0, INF),)
    standard = "joint"
    experiment = "vary kd, or command a velocity: a servo's damping follows both, a joint's does not"
    usual, named_first = "joint", 2
    law = Law(fixed((("v",), VELOCITY, 1)), "v", lambda now, was: {"v": -(now[0] - was[0])})

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        joint = joint_of(spec, place)
        joint.damping = [values[0], *joint.damping[1:]]

    def write(self, spot: Spot, *values: float) -> None:
        spot.model.dof_damping[spot.dof] = values[0]

    def declared(self, spot: Spot) -> Sequence[float]:
        return (spot.model.dof_damping[spot.dof],)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.torque / on.speed,))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [c.step[0] * -along.v]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        excess = effect.value() - draft.robot.model.dof_damping[draft.robot.dofs[columns]]
        draft.viscous[columns] = excess
        taken = (draft.robot.own_kd - draft.kd_wanted)[columns]
        rest = "" if np.allclose(taken, excess) else f", {spread(excess - taken, 'N m s/rad')} fed forward"
        done = "kd sent is lower by it; the rest along the intended velocity"
        return done, f"{spread(taken, 'N m s/rad')} off kd{rest}"
