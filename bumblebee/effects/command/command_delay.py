"""Commands that come late."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.mjcf import servos_of
from bumblebee.effects.places import OnJoint, OnRobot, Spot, Step
from bumblebee.effects.words import milliseconds
from bumblebee.robot.drives import buffer_length


class CommandDelay(Kind):
    """The mean of the held, delayed command over each step, as MuJoCo's actuators have it with interp="linear"."""

    rank = 120
    parameters = (Parameter("delay", "s", 0.0, 0.1),)
    whole = True
    drive = "any"
    experiment = "command steps and log the torque"
    usual, named_first = "robot", 5
    law = "no term has an older target"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        for servo in servos_of(spec, place):
            servo.delay = values[0]
            servo.nsample = buffer_length(values[0], spec.option.timestep)
            servo.interp = 1

    def write(self, spot: Spot, *values: float) -> None:
        spot.delay[spot.actuator] = values[0]

    def declared(self, spot: Spot) -> Sequence[float]:
        return (spot.delay[spot.actuator] if spot.actuator >= 0 else 0.0,)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.rules.drive.time,))

    def steps_together(self, on: OnRobot) -> Iterator[Step]:
        if np.ptp(on.delays) == 0:
            yield Step((on.rules.drive.time,), start=(float(on.delays[0]),))

    def torque(self, along: Any, c: Any) -> Sequence[np.ndarray]:
        return [along.commanded(c)]

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        draft.arrays["command_delay"][columns] = np.maximum(effect.value() - draft.robot.delay[columns], 0.0)
        done = (
            "the reference's part is sent that much earlier, corrections are carried on; "
            "answers to what is read stay late"
        )
        return done, milliseconds(effect)
