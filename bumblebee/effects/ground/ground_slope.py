"""A floor, or the mount of a robot with a fixed base, that is not level."""

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.kind import Kind, Parameter
from bumblebee.effects.law import OF_ONE_JOINT
from bumblebee.effects.native import sloped
from bumblebee.effects.places import OnRobot, Spot, Step


class GroundSlope(Kind):
    """The turn about the world's axes that takes the declared gravity to the true one; with gravity along z, z is 0."""

    on = "whole"
    rank = 360
    parameters = (*(Parameter(axis, "rad", -0.5, 0.5) for axis in "xy"), Parameter("z", "rad", -0.5, 0.5, 0.0))
    absent = 0.0
    experiment = "turn the robot by 180 degrees on the spot"
    on_fixed_base = "put a level on the mount, or bolt it down turned by 180 degrees"
    law = OF_ONE_JOINT
    not_undone = "it is in the floor or the mount, not in a joint"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        spec.option.gravity = sloped(spec.option.gravity, *values)

    def write(self, spot: Spot, *values: float) -> None:
        spot.model.opt.gravity = sloped(spot.model.opt.gravity, *values)

    def steps(self, on: OnRobot) -> Iterator[Step]:
        gravity = np.abs(on.model.opt.gravity)
        if gravity.any():  # not about the axis that it is next to
            free = tuple(sorted(np.argsort(gravity, kind="stable")[:2].tolist()))
            turns = tuple(on.rules.body.slope if axis in free else 0.0 for axis in range(3))
            yield Step(turns, free=free)

    def torque(self, along: Any, c: Any) -> np.ndarray:
        def turned(model: mujoco.MjModel, f: int) -> None:
            turn = [0.0, 0.0, 0.0]
            turn[f] = c.step[f]
            model.opt.gravity = sloped(model.opt.gravity, *turn)

        return along.inertial(c.free, turned)
