"""The largest torque that a drive gives."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.kind import INF, Kind, Parameter
from bumblebee.effects.law import TORQUE, Law, Rows
from bumblebee.effects.mjcf import servos_of
from bumblebee.effects.places import OnJoint, Spot, Step
from bumblebee.robot.drives import force_limit


def _rows(data: Any, j: int) -> Rows:
    for share in data.thresholds.term_library.saturation_quantiles:
        edge = f"{np.quantile(np.abs(data.tau[..., j]), share):.4g}"
        yield (f"relu(tau - {edge}) - relu(-tau - {edge})",), TORQUE, 2


class TorqueLimit(Kind):
    """The servo's torque within -limit and limit; a supply voltage that is stated scales it."""

    rank = 240
    parameters = (Parameter("limit", "N m", 1e-3, INF),)
    drive = "position"
    experiment = "hold a growing load"
    fine_steps = saturation = True
    law = Law(_rows, "", driven=True)
    not_undone = "a torque that the motor does not have cannot be asked of it"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        for servo in servos_of(spec, place):
            force = values[0] / abs(servo.gear[0])
            servo.forcerange, servo.forcelimited = [-force, force], mujoco.mjtLimited.mjLIMITED_TRUE

    def write(self, spot: Spot, *values: float) -> None:
        model, a = spot.model, spot.actuator
        force = values[0] * spot.supply / abs(model.actuator_gear[a, 0])
        model.actuator_forcelimited[a], model.actuator_forcerange[a] = 1, (-force, force)

    def declared(self, spot: Spot) -> Sequence[float]:
        model, a = spot.model, spot.actuator
        limited = a >= 0 and model.actuator_forcelimited[a]
        given = abs(model.actuator_gear[a, 0]) * force_limit(model, a) if limited else np.inf
        return (given / spot.supply,)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        limit = float(self.declared(on.spot)[0])
        for share in on.rules.drive.limit:
            if on.peak > 0 and share * on.peak < limit:
                yield Step(((share - 1.0) * on.peak,), start=(min(limit, on.peak),))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        limit = c.start[0] * along.supply
        return [np.clip(along.torque, -limit, limit) - along.torque]
