"""Viscous friction of a motor that turns with two joints, by the sum or the difference of their angles."""

from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.coupled import Coupled, ratio_from
from bumblebee.effects.kind import INF, Parameter
from bumblebee.effects.places import OnJoint


class CoupledDamping(Coupled):
    """-damping (v + ratio v_before) on the joint, `ratio` times that on the one before.

    MuJoCo's damping of a fixed tendon along the joint and the one before it on its chain.
    """

    rank = 164
    parameters = (Parameter("damping", "N m s/rad", 0.0, INF), ratio_from(-20.0))
    experiment = "move both joints together, then against each other, at several speeds"

    def give(self, tendon: Any, size: float) -> None:
        tendon.damping = [size, *tendon.damping[1:]]

    def sizes(self, model: mujoco.MjModel) -> np.ndarray:
        return model.tendon_damping

    def size(self, on: OnJoint) -> float:
        return on.torque / on.speed
