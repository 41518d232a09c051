"""Friction of the ground with what stands on it."""

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from bumblebee.effects.kind import Kind, Parameter
from bumblebee.effects.law import OF_ONE_JOINT
from bumblebee.effects.mjcf import ground_of
from bumblebee.effects.native import touching
from bumblebee.effects.places import OnBody, Spot, Step


class GroundFriction(Kind):
    """Sliding friction of the geometry and, at most, of all that can touch it: of two the larger counts."""

    on = "geom"
    rank = 340
    parameters = (Parameter("friction", "", 0.0, 5.0),)
    experiment = "push a standing robot sideways until it slips"
    column, fine_steps = "simulated", True
    law = OF_ONE_JOINT
    not_undone = "it is in the floor, not in a joint"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        ground, others = ground_of(spec, place)
        ground.friction = [values[0], *ground.friction[1:]]
        for geom in others:
            geom.friction = [min(values[0], geom.friction[0]), *geom.friction[1:]]

    def write(self, spot: Spot, *values: float) -> None:
        friction, others = spot.model.geom_friction, touching(spot.model, spot.geom)
        friction[spot.geom, 0] = values[0]
        friction[others, 0] = np.minimum(values[0], friction[others, 0])

    def declared(self, spot: Spot) -> Sequence[float]:
        friction, others = spot.model.geom_friction, touching(spot.model, spot.geom)
        return (max(friction[spot.geom, 0], np.median([friction[g, 0] for g in others]) if others else 0.0),)

    def steps(self, on: OnBody) -> Iterator[Step]:
        value = float(self.declared(on.spot)[0])
        if value > 0:
            yield Step((on.rules.ground_friction * value,))
