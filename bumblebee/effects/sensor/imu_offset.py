"""A floating base's sensor that is mounted askew."""

from collections.abc import Iterator, Sequence
from typing import Any

from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.law import IN_THE_READINGS
from bumblebee.effects.places import OnBody, Step


class ImuOffset(Kind):
    """The reading of the orientation, turned by the rotation vector (roll, pitch, 0) in the base's frame."""

    on, base = "body", True
    rank = 280
    parameters = (Parameter("roll", "rad", -0.5, 0.5), Parameter("pitch", "rad", -0.5, 0.5))
    native, absent = False, 0.0
    experiment = "turn the robot by 180 degrees on the spot, on a levelled floor"
    column, fine_steps = "simulated", True
    law = IN_THE_READINGS

    def hook(self, making: Any, effect: Given) -> None:
        making.tilt(effect)

    def steps(self, on: OnBody) -> Iterator[Step]:
        yield Step((on.rules.tilt, on.rules.tilt), free=(0, 1))

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        roll, pitch = draft.imu[:2] = effect.values()
        return "turned back out of the orientation reading", f"roll {roll:+.4g}, pitch {pitch:+.4g} rad"
