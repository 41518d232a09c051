"""Inertia of the rotor as the joint feels it."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.hinges import joint_of
from bumblebee.effects.kind import INF, Given, Kind, Parameter
from bumblebee.effects.places import OnJoint, Spot, Step
from bumblebee.effects.words import spread


class Armature(Kind):
    """-armature a."""

    rank = 60
    parameters = (Parameter("armature", "kg m^2", 0.0, INF),)
    constants = True
    standard = "joint"
    experiment = "accelerate the joint with the link taken off or with a known weight on it"
    usual, named_first = "joint", 3
    law = "no term has the acceleration"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        joint_of(spec, place).armature = values[0]

    def write(self, spot: Spot, *values: float) -> None:
        spot.model.dof_armature[spot.dof] = values[0]

    def declared(self, spot: Spot) -> Sequence[float]:
        return (spot.model.dof_armature[spot.dof],)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.rules.joint.inertia * on.inertia,))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [c.step[0] * -along.a]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        excess = effect.value() - draft.robot.model.dof_armature[draft.robot.dofs[columns]]
        draft.arrays["armature"][columns] = excess
        return "fed forward with the reference's acceleration", spread(excess, "kg m^2")
