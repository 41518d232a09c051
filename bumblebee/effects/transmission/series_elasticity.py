"""A flexible shaft between a motor and its link."""

from collections.abc import Iterator
from typing import Any

import mujoco

from bumblebee.effects.hinges import add_elasticity
from bumblebee.effects.kind import INF, Given, Kind, Parameter
from bumblebee.effects.law import STRUCTURE
from bumblebee.effects.native import SUFFIX
from bumblebee.effects.places import OnJoint, Spot, Step


class SeriesElasticity(Kind):
    """A second hinge with a stiffness, damped by `loss` times that.

    `encoder` 0: it reads the motor; 1: the joint, behind the shaft, a hook. A `share` of the rotor turns with the link.
    """

    rank = 150
    parameters = (
        Parameter("stiffness", "N m/rad", 1e-2, INF),
        Parameter("encoder", "", 0.0, 1.0, 0.0, choice=True),
        Parameter("loss", "s", 0.0, 0.1, 1e-3),
        Parameter("share", "", 0.0, 0.5, 0.0, matters=0.1),
    )
    hooked = "encoder"
    structural = True
    absent = INF
    drive = "any"
    experiment = "load the joint with the motor held"
    column = "simulated"
    fine_steps = inverse = costly = True
    law = STRUCTURE
    not_undone = "the bend of the shaft is not measured, and undoing it needs the load's acceleration"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        add_elasticity(spec, place, *values)

    def write(self, spot: Spot, *values: float) -> None:
        stiffness, _, loss, _ = values
        model, second = spot.model, int(spot.model.joint(spot.place + SUFFIX[self.id]).id)
        model.jnt_stiffness[second] = stiffness
        model.dof_damping[model.jnt_dofadr[second]] = loss * stiffness

    def hook(self, making: Any, effect: Given) -> None:
        if effect.values()[1]:
            making.rotors(self.id, effect)

    def steps(self, on: OnJoint) -> Iterator[Step]:
        if on.peak > 0 and on.ends_its_body:
            rule = on.rules.transmission
            for encoder in (0.0, 1.0):  # on the motor, on the joint
                steps = (_twist(on, encoder), encoder, rule.damping, rule.link_share)
                yield Step(steps, shape=rule.damping_shape)


def _twist(on: OnJoint, encoder: float) -> float:
    """Compliance [rad/(N m)] that matters; a servo that reads the joint behind a soft shaft would swing it up."""
    rule, model, a = on.rules.transmission, on.spot.model, on.spot.actuator
    large = rule.twist * max(on.travel, on.rules.joint.travel) / on.peak
    gain = abs(model.actuator_gear[a, 0] ** 2 * model.actuator_biasprm[a, 1])
    return float(min(large, rule.stiff / gain) if encoder and gain else large)
