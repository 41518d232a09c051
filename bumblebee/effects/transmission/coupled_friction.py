"""Dry friction of motors that turn with two joints, one with the sum of their angles and one with the difference."""

from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.coupled import Coupled, ratio_from
from bumblebee.effects.kind import INF, Parameter
from bumblebee.effects.mjcf import STICTION_ITERATIONS, STICTION_SOLIMP, STICTION_SOLREF
from bumblebee.effects.places import OnJoint


class CoupledFriction(Coupled):
    """-sum sgn(v + ratio v_before) on the joint, `ratio` times that on the one before; and so with the difference.

    MuJoCo's frictionloss of two fixed tendons along the joint and the one before it on its chain.
    """

    rank = 162
    parameters = (Parameter("sum", "N m", 0.0, INF), Parameter("difference", "N m", 0.0, INF), ratio_from(0.05))
    ways = (1.0, -1.0)
    experiment = "move both joints together, then against each other, at the same speeds"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        super().add(spec, place, *values)
        spec.option.iterations = max(spec.option.iterations, STICTION_ITERATIONS)
        spec.option.ls_iterations = max(spec.option.ls_iterations, STICTION_ITERATIONS)

    def give(self, tendon: Any, size: float) -> None:
        tendon.frictionloss, tendon.solref_friction = size, STICTION_SOLREF
        tendon.solimp_friction = [STICTION_SOLIMP, STICTION_SOLIMP, *tendon.solimp_friction[2:]]

    def sizes(self, model: mujoco.MjModel) -> np.ndarray:
        return model.tendon_frictionloss

    def size(self, on: OnJoint) -> float:
        return on.torque

    def answer(self, along: Any, motion: np.ndarray) -> np.ndarray:
        return -along.direction(motion)
