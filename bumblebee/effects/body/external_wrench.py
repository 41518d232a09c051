"""A force on a body: a cable that pulls, a hand that holds on."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from bumblebee.effects.kind import INF, Given, Kind, Parameter
from bumblebee.effects.law import OF_ONE_JOINT
from bumblebee.effects.places import OnBody, Step


class ExternalWrench(Kind):
    """Force and torque in the world at the body's centre of mass. The search has the force alone."""

    on = "body"
    rank = 330
    parameters = (
        *(Parameter(f"f{axis}", "N", -INF, INF) for axis in "xyz"),
        *(Parameter(f"t{axis}", "N m", -INF, INF) for axis in "xyz"),
    )
    native, absent = False, 0.0
    experiment = "unplug what is tethered, and repeat in another heading"
    law = OF_ONE_JOINT
    not_undone = "it acts on a body of a floating robot: only the feet could answer it"

    def hook(self, making: Any, effect: Given) -> None:
        making.append("wrench", [(body, np.array(effect.values())) for body in making.bodies(effect)])

    def steps(self, on: OnBody) -> Iterator[Step]:
        yield Step((*(9.81 * on.heavy,) * 3, 0.0, 0.0, 0.0), free=(0, 1, 2))

    def torque(self, along: Any, c: Any) -> np.ndarray:
        rows = along.jacobians(c.where)
        return np.stack([c.step[f] * rows[:, :, f] for f in c.free])
