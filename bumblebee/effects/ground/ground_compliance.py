"""Ground that gives way under what stands on it."""

from collections.abc import Iterator, Sequence

import mujoco

from bumblebee.effects.kind import Kind, Parameter
from bumblebee.effects.law import OF_ONE_JOINT
from bumblebee.effects.mjcf import ground_of
from bumblebee.effects.native import touching
from bumblebee.effects.places import OnBody, Spot, Step


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
        for geom in (ground, *others):
            geom.solref = [values[0], *geom.solref[1:]]

    def write(self, spot: Spot, *values: float) -> None:
        spot.model.geom_solref[[spot.geom, *touching(spot.model, spot.geom)], 0] = values[0]

    def declared(self, spot: Spot) -> Sequence[float]:
        return (spot.model.geom_solref[spot.geom, 0],)

    def steps(self, on: OnBody) -> Iterator[Step]:
        value = float(self.declared(on.spot)[0])
        if value > 0:
            yield Step((on.rules.ground_compliance * value,))
