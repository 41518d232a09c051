"""Dry friction that is not the same both ways: a constant torque beside that of the mean."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.hinges import angle_of, joint_of
from bumblebee.effects.kind import INF, Given, Kind, Parameter
from bumblebee.effects.mjcf import set_spring, set_spring_in_place
from bumblebee.effects.places import OnJoint, Spot, Step


class AsymmetricFriction(Kind):
    """-difference / 2, forward less backward, in MJCF a weak spring with a far reference.

    Beside it stands coulomb_friction, the mean of both ways, where that changed too.
    """

    rank, last = 50, True
    parameters = (Parameter("difference", "N m", -INF, INF),)
    absent = 0.0
    experiment = "move the joint at the same speed both ways, with the joint's axis vertical"
    on_dry_friction = True
    law = "its torque is that of 1, which is called joint_spring"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        joint = joint_of(spec, place)
        stiffness = float(joint.stiffness[0])
        preload = stiffness * joint.springref / angle_of(spec, joint)
        set_spring(spec, joint, stiffness, preload - 0.5 * values[0])

    def write(self, spot: Spot, *values: float) -> None:
        model, joint = spot.model, spot.joint
        stiffness, rest = model.jnt_stiffness[joint], model.qpos_spring[model.jnt_qposadr[joint]]
        set_spring_in_place(spot, stiffness, stiffness * rest - 0.5 * values[0])

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.torque,))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [c.step[0] * np.full_like(along.q, -0.5)]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        draft.arrays["asymmetry"][columns] = effect.value()
        return "half the difference is sent constantly", f"{0.5 * effect.value():+.3g} N m"
