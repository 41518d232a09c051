"""Viscous friction of a motor that turns with two joints: with the sum of their angles, or with the difference."""

from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.coupled import Coupled, coupled
from bumblebee.effects.places import OnJoint


class CoupledDamping(Coupled):
    """-sum (v + ratio v_before), on both joints, and the same of the difference.

    MuJoCo's damping of two fixed tendons along the joint and the one before it on its chain.
    """

    rank = 164
    parameters = coupled("N m s/rad")
    experiment = "move both joints together, then against each other, at several speeds"

    def give(self, tendon: Any, size: float) -> None:
        tendon.damping = [size, *tendon.damping[1:]]

    def sizes(self, model: mujoco.MjModel) -> np.ndarray:
        return model.tendon_damping

    def size(self, on: OnJoint) -> float:
        return on.torque / on.speed
