"""Play between a motor and its link."""

from collections.abc import Iterator
from typing import Any

import mujoco

from bumblebee.effects.hinges import add_backlash
from bumblebee.effects.kind import Given, Kind, Parameter
from bumblebee.effects.law import STRUCTURE
from bumblebee.effects.native import SUFFIX
from bumblebee.effects.places import OnJoint, Spot, Step


class Backlash(Kind):
    """A second hinge with a range; `encoder` 0: it reads the motor; 1: it reads the joint, behind the play, a hook."""

    rank = 160
    parameters = (Parameter("gap", "rad", 0.0, 0.5), Parameter("encoder", "", 0.0, 1.0, 0.0, choice=True))
    hooked = "encoder"
    structural = True
    absent = 0.0
    beside = ("series_elasticity",)
    drive = "any"
    experiment = "rock the joint with the motor held"
    column = "simulated"
    fine_steps = abrupt = True
    law = STRUCTURE
    not_undone = "within its play the motor does not touch the link"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        add_backlash(spec, place, *values)

    def write(self, spot: Spot, *values: float) -> None:
        second = int(spot.model.joint(spot.place + SUFFIX[self.id]).id)
        spot.model.jnt_range[second] = (-0.5 * values[0], 0.5 * values[0])

    def hook(self, making: Any, effect: Given) -> None:
        if effect.values()[1]:
            making.rotors(self.id, effect)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        if on.peak > 0 and on.ends_its_body:
            rule = on.rules.transmission
            for encoder in (0.0, 1.0):  # on the motor, on the joint
                yield Step((max(rule.backlash * on.travel, rule.least_backlash), encoder))
