"""A link that is harder or easier to turn."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.kind import INF, Kind, Parameter
from bumblebee.effects.law import OF_ONE_JOINT
from bumblebee.effects.mjcf import body_of
from bumblebee.effects.native import physical_inertia
from bumblebee.effects.places import OnBody, Spot, Step


class LinkInertia(Kind):
    """Principal moments of inertia, none above the sum of the other two."""

    on = "body"
    rank = 320
    parameters = tuple(Parameter(axis, "kg m^2", 1e-9, INF) for axis in ("xx", "yy", "zz"))
    constants = True
    standard = "link"
    experiment = "swing the link fast about each axis"
    law = OF_ONE_JOINT
    not_undone = "it asks for torque only as the whole body accelerates, which is not planned for"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        body_of(spec, place).inertia = physical_inertia(values)

    def write(self, spot: Spot, *values: float) -> None:
        spot.model.body_inertia[spot.body] = physical_inertia(values)

    def declared(self, spot: Spot) -> np.ndarray:
        return spot.model.body_inertia[spot.body]

    def steps(self, on: OnBody) -> Iterator[Step]:
        turned = tuple(on.rules.moments * on.moments + on.rules.least_moment)
        yield Step(turned, free=(0, 1, 2))

    def bounds(self, nominal: Sequence[float], limits: Any) -> tuple[np.ndarray, np.ndarray]:
        low, high = super().bounds(nominal, limits)
        return np.maximum(low, limits.point * np.array(nominal)), high

    def physical(self, values: np.ndarray) -> np.ndarray:
        return physical_inertia(values)  # type: ignore[arg-type]

    def torque(self, along: Any, c: Any) -> np.ndarray:
        def turned(model: mujoco.MjModel, f: int) -> None:
            model.body_inertia[model.body(c.where).id, f] += c.step[f]

        return along.inertial(c.free, turned)
