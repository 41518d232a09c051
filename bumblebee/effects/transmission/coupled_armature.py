"""Inertia of the rotor of a motor that turns with two joints, by the sum or the difference of their angles."""

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.coupled import Coupled, ratio_from
from bumblebee.effects.kind import INF, Parameter
from bumblebee.effects.places import OnJoint, Step

_PARALLEL = 0.99
"""Cosine of the axes beyond which a rotor on the sum is the inertia of the link, under another name."""


class CoupledArmature(Coupled):
    """-armature (a + ratio a_before) on the joint, `ratio` times that on the one before.

    MuJoCo's armature of a fixed tendon along the joint and the one before it on its chain. Along parallel axes the
    link's own inertia is the same.
    """

    rank = 166
    parameters = (Parameter("armature", "kg m^2", 0.0, INF), ratio_from(-20.0))
    experiment = "accelerate both joints together, then against each other"

    def give(self, tendon: Any, size: float) -> None:
        tendon.armature = size

    def sizes(self, model: mujoco.MjModel) -> np.ndarray:
        return model.tendon_armature

    def steps(self, on: OnJoint) -> Iterator[Step]:
        if on.before and not _parallel(on.spot.model, on.spot.place, on.before):
            yield from super().steps(on)

    def size(self, on: OnJoint) -> float:
        return on.rules.joint.inertia * on.inertia

    def felt(self, along: Any, j: int) -> np.ndarray:
        return along.a[..., j]


def _parallel(model: mujoco.MjModel, *joints: str) -> bool:
    """Whether two joints turn about parallel axes."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    one, other = (data.xaxis[model.joint(joint).id] for joint in joints)
    return bool(abs(one @ other) > _PARALLEL)
