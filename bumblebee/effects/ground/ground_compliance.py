"""Ground that gives way under what stands on it."""

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from bumblebee.effects import native
from bumblebee.effects.kind import Kind, Parameter
from bumblebee.effects.law import OF_ONE_JOINT
from bumblebee.effects.mjcf import ground_of, pairs_of
from bumblebee.effects.native import touching
from bumblebee.effects.places import OnBody, Spot, Step


def _softer(solref: np.ndarray, time: float) -> np.ndarray:
    """Contacts (K, 2) with another time constant [s]; critically damped where a stiffness and a damping were given."""
    return np.where(solref[:, :1] > 0, np.column_stack((np.full(len(solref), time), solref[:, 1])), (time, 1.0))


class GroundCompliance(Kind):
    """Time constant of the contacts of the geometry and of all that can touch it, MuJoCo's solref."""

    on = "geom"
    rank = 350
    parameters = (Parameter("time", "s", 2e-3, 0.5),)
    experiment = "drop the robot's foot on the floor"
    column, fine_steps = "simulated", True
    law = OF_ONE_JOINT
    not_undone = "it is in the floor, not in a joint"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        ground, others = ground_of(spec, place)
        for part in (ground, *others, *pairs_of(spec, place)):
            part.solref = _softer(np.array(part.solref)[None], values[0])[0]

    def write(self, spot: Spot, *values: float) -> None:
        model = spot.model
        for solref, some in (
            (model.geom_solref, [spot.geom, *touching(model, spot.geom)]),
            (model.pair_solref, native.pairs_of(model, spot.geom)),
        ):
            solref[some] = _softer(solref[some], values[0])

    def declared(self, spot: Spot) -> Sequence[float]:
        model, others = spot.model, touching(spot.model, spot.geom)
        first = [g for g in others if model.geom_priority[g] > model.geom_priority[spot.geom]]
        counts = model.geom_solref[first or [spot.geom], 0]
        named = model.pair_solref[native.pairs_of(model, spot.geom), 0]
        return (float(np.median(counts if others or not len(named) else named)),)

    def steps(self, on: OnBody) -> Iterator[Step]:
        value = float(self.declared(on.spot)[0])
        if value > 0:
            yield Step((on.rules.ground_compliance * value,))
