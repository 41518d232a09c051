"""Friction of the ground with what stands on it."""

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from bumblebee.effects import native
from bumblebee.effects.kind import Kind, Parameter
from bumblebee.effects.law import OF_ONE_JOINT
from bumblebee.effects.mjcf import ground_of, pairs_of
from bumblebee.effects.native import touching
from bumblebee.effects.places import OnBody, Spot, Step


class GroundFriction(Kind):
    """Sliding friction of the geometry and, at most, of all that can touch it: of two the larger counts.

    Or that of the geometry with the higher priority, or of a contact pair that the model names.
    """

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
            most = np.inf if geom.priority > ground.priority else geom.friction[0]
            geom.friction = [min(values[0], most), *geom.friction[1:]]
        for pair in pairs_of(spec, place):
            pair.friction = [values[0], values[0], *pair.friction[2:]]

    def write(self, spot: Spot, *values: float) -> None:
        model, others = spot.model, touching(spot.model, spot.geom)
        first = model.geom_priority[others] > model.geom_priority[spot.geom]
        model.geom_friction[spot.geom, 0] = values[0]
        model.geom_friction[others, 0] = np.minimum(values[0], np.where(first, np.inf, model.geom_friction[others, 0]))
        model.pair_friction[native.pairs_of(model, spot.geom), :2] = values[0]

    def declared(self, spot: Spot) -> Sequence[float]:
        model, others = spot.model, touching(spot.model, spot.geom)
        own, theirs = model.geom_friction[spot.geom, 0], model.geom_friction[others, 0]
        before = model.geom_priority[others] - model.geom_priority[spot.geom]
        each = np.where(before > 0, theirs, np.where(before < 0, own, np.maximum(own, theirs)))
        each = np.concatenate((each, model.pair_friction[native.pairs_of(model, spot.geom), 0]))
        return (float(np.median(each)) if len(each) else own,)

    def steps(self, on: OnBody) -> Iterator[Step]:
        value = float(self.declared(on.spot)[0])
        if value > 0:
            yield Step((on.rules.ground_friction * value,))
