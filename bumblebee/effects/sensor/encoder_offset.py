"""An encoder that is off by an angle, in the log and in the servo's loop."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco

from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.law import IN_THE_READINGS
from bumblebee.effects.mjcf import drives_of
from bumblebee.effects.places import OnJoint, Spot, Step


class EncoderOffset(Kind):
    """The reading is q + offset. The servo's part is biasprm[0] = biasprm[1] * offset, the log's a hook."""

    rank, last = 100, True
    parameters = (Parameter("offset", "rad", -1.0, 1.0),)
    native = False
    experiment = "move the joint against a stop of known angle"
    column = "simulated"
    usual, named_first = "joint", 6
    law = IN_THE_READINGS

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        for servo in drives_of(spec, place):  # the encoder of a passive joint moves nothing
            bias = servo.biasprm.copy()
            bias[0] = bias[1] * values[0] * servo.gear[0]
            servo.biasprm = bias

    def write(self, spot: Spot, *values: float) -> None:
        model, a = spot.model, spot.actuator
        if a >= 0:
            model.actuator_biasprm[a, 0] = model.actuator_biasprm[a, 1] * values[0] * model.actuator_gear[a, 0]
        spot.offset[spot.column] = values[0]

    def hook(self, making: Any, effect: Given) -> None:
        making.first("encoder_offset", effect)

    def declared(self, spot: Spot) -> Sequence[float]:
        return (spot.offset[spot.column],)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        yield Step((on.rules.joint.offset,))

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        excess = effect.value() - draft.robot.offset[columns]
        draft.arrays["encoder_offset"][columns] = excess
        return "taken off the reading, added to the target", f"{float(excess.mean()):+.4g} rad"
