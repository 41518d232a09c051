"""Friction that a joint at rest has beside its dry friction, and that goes as it gains speed."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.kind import INF, Given, Kind, Parameter
from bumblebee.effects.law import VELOCITY, Law, Rows
from bumblebee.effects.mjcf import stick, stick_in_place
from bumblebee.effects.places import OnJoint, Spot, Step
from bumblebee.effects.words import fed_along


def _rows(data: Any, j: int) -> Rows:
    speed = float(np.sqrt((data.v[..., j] ** 2).mean())) + 1e-9
    for share in data.thresholds.term_library.stribeck_speeds:
        yield (f"friction(exp(-(v/{share * speed:.3g})^2))",), VELOCITY, 2


class StribeckFriction(Kind):
    """-stiction exp(-(v / velocity)^2) sgn(v)."""

    rank = 40
    parameters = (Parameter("stiction", "N m", 0.0, INF), Parameter("velocity", "rad/s", 1e-3, 100.0))
    native, absent = False, 0.0
    experiment = "creep through zero speed"
    on_dry_friction = True
    law = Law(_rows, "friction(", lambda now, was: {f"friction(exp(-(v/{now[1]:.3g})^2))": now[0]})

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        stick(spec, place)

    def write(self, spot: Spot, *values: float) -> None:
        stick_in_place(spot)

    def hook(self, making: Any, effect: Given) -> None:
        making.rows("stiction", effect)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        rule = on.rules.joint
        for share in rule.stribeck:
            speed = share * on.speed
            yield Step((on.torque, speed), shape=rule.shape * speed)

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [-c.step[0] * np.exp(-((along.v / c.step[1]) ** 2)) * along.sign]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        stiction, speed = effect.values()
        draft.arrays["stiction"][columns], draft.arrays["stiction_speed"][columns] = stiction, speed
        return fed_along(draft), f"{draft.limits.friction_share * stiction:.3g} N m, gone at {speed:.3g} rad/s"
