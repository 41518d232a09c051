"""A link, or what it carries, that weighs more or less than declared."""

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects.kind import INF, Given, Kind, Parameter
from bumblebee.effects.law import OF_ONE_JOINT
from bumblebee.effects.mjcf import body_of
from bumblebee.effects.native import spread_inertia
from bumblebee.effects.places import OnBody, Spot, Step
from bumblebee.effects.words import spread


class LinkMass(Kind):
    """Mass; `spread` 0: what is added sits at the centre of mass; 1: the moments of inertia grow as the mass does."""

    on = "body"
    rank = 300
    parameters = (Parameter("mass", "kg", 1e-3, INF), Parameter("spread", "", 0.0, 1.0, 0.0))
    constants = True
    standard = "link"
    experiment = "add 2 kg to the link, or weigh it"
    usual, named_first = "body", 7
    law = OF_ONE_JOINT

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        (mass, share), body = values, body_of(spec, place)
        if share:
            body.inertia = spread_inertia(body.inertia, mass / body.mass, share)
        body.mass = mass

    def write(self, spot: Spot, *values: float) -> None:
        model, body, (mass, share) = spot.model, spot.body, values
        factor = mass / model.body_mass[body]
        model.body_inertia[body] = spread_inertia(model.body_inertia[body], factor, share)
        model.body_mass[body] = mass

    def declared(self, spot: Spot) -> Sequence[float]:
        return (spot.model.body_mass[spot.body],)

    def steps(self, on: OnBody) -> Iterator[Step]:
        yield Step((on.heavy, 0.0))
        yield Step((on.heavy, 1.0))

    def torque(self, along: Any, c: Any) -> np.ndarray:
        def heavier(model: mujoco.MjModel, f: int) -> None:
            body = model.body(c.where).id
            factor = 1 + c.step[f] / model.body_mass[body]
            model.body_inertia[body] = spread_inertia(model.body_inertia[body], factor, c.start[1])
            model.body_mass[body] *= factor

        return along.inertial(c.free, heavier)

    def undo(self, draft: Any, effect: Given, columns: Sequence[int]) -> tuple[str, str]:
        added = [effect.value() - draft.load(body).mass[0] for body in effect.where]
        for body in effect.where:
            draft.carry(body, mass=effect.value())
        return "its weight along the reference is fed forward", f"{spread(np.array(added), 'kg')} more"
