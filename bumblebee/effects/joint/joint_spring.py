"""A spring on a joint, and the torque of its rest."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.hinges import joint_of
from bumblebee.effects.kind import INF, Given, Kind, Parameter
from bumblebee.effects.law import POSITION, Law, fixed
from bumblebee.effects.mjcf import set_spring, set_spring_in_place
from bumblebee.effects.places import OnJoint, Spot, Step


class JointSpring(Kind):
    """-stiffness q + preload."""

    rank = 70
    parameters = (Parameter("stiffness", "N m/rad", -INF, INF), Parameter("preload", "N m", -INF, INF))
    standard = "link"
    experiment = "move the joint slowly through its whole range, unpowered"
    law = Law(
        fixed((("1",), (), 1), (("q", "1"), POSITION, 1)),
        "q",
        lambda now, was: {"q": -(now[0] - was[0]), "1": now[1] - was[1]},
    )

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        set_spring(spec, joint_of(spec, place), *values)

    def write(self, spot: Spot, *values: float) -> None:
        set_spring_in_place(spot, *values)

    def declared(self, spot: Spot) -> Sequence[float]:
        model, joint = spot.model, spot.joint
        stiffness = float(model.jnt_stiffness[joint])
        return (stiffness, stiffness * float(model.qpos_spring[model.jnt_qposadr[joint]]))

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.torque / max(on.travel, on.rules.joint.spring_travel), on.torque), free=(0, 1))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [-c.step[0] * along.q, np.full_like(along.q, c.step[1])]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        stiffness, preload = effect.values()
        model = draft.robot.model
        for column in columns:
            joint = int(model.dof_jntid[draft.robot.dofs[column]])
            declared = float(np.ravel(model.jnt_stiffness[joint])[0])
            reference = float(model.qpos_spring[model.jnt_qposadr[joint]])
            draft.arrays["spring"][column] = stiffness - declared
            draft.arrays["preload"][column] = preload - declared * reference
        done = "its torque at the measured angle is sent against it"
        return done, f"{stiffness:.3g} N m/rad, {preload:+.3g} N m"
