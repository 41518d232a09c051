"""A link whose centre of mass is elsewhere."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.law import OF_ONE_JOINT
from bumblebee.effects.mjcf import body_of
from bumblebee.effects.places import OnBody, Spot, Step
from bumblebee.effects.words import spread


class LinkCom(Kind):
    """The centre of mass in the body's frame."""

    on = "body"
    rank = 310
    parameters = tuple(Parameter(axis, "m", -2.0, 2.0) for axis in ("x", "y", "z"))
    constants = True
    standard = "link"
    experiment = "hold the link still in several poses and log the torque"
    usual = "body"
    law = OF_ONE_JOINT

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        body_of(spec, place).ipos = values

    def write(self, spot: Spot, *values: float) -> None:
        spot.model.body_ipos[spot.body] = values

    def declared(self, spot: Spot) -> np.ndarray:
        return spot.model.body_ipos[spot.body]

    def steps(self, on: OnBody) -> Iterator[Step]:
        size = float(np.sqrt(1.5 * on.moments.sum() / on.mass))  # of a ball of this inertia, twice
        yield Step((max(on.rules.com * size, on.rules.least_com),) * 3, free=(0, 1, 2))

    def torque(self, along: Any, c: Any) -> np.ndarray:
        def moved(model: mujoco.MjModel, f: int) -> None:
            model.body_ipos[model.body(c.where).id, f] += c.step[f]

        return along.inertial(c.free, moved)

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        away = [float(np.linalg.norm(np.subtract(effect.values(), draft.load(body).com[0]))) for body in effect.where]
        for body in effect.where:
            draft.carry(body, com=effect.values())
        return "its weight along the reference is fed forward", f"{spread(1000 * np.array(away), 'mm')} away"
