"""A level surface that the model lacks, and the point of a hand or finger that touches it."""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from bumblebee.effects import native
from bumblebee.effects.bare import bare_pair
from bumblebee.effects.kind import Kind, Parameter
from bumblebee.effects.places import Spot
from bumblebee.errors import BadInput

_ROLLING = (0.005, 1e-4, 1e-4)  # MuJoCo's own, which a contact of three dimensions does not ask


class SurfaceContact(Kind):
    """A sphere of 1 mm on the body, a plane of the world, and a contact pair of these two and nothing else.

    Sought on robots with a fixed base of up to 12 degrees of freedom, by how low their bodies come
    (`diagnosis.candidates.surfaces`).
    """

    on = "body"
    rank = 370
    parameters = (
        Parameter("height", "m", native.NO_SURFACE, 10.0),
        *(Parameter(axis, "m", -2.0, 2.0) for axis in "xyz"),
        Parameter("friction", "", 0.0, 5.0, 1.0, matters=0.1),
    )
    structural = stateless = True
    experiment = "repeat the motion with the robot lifted off what it may touch, or with that taken away"
    column = "simulated"
    abrupt = judged_alone = True
    law = "where it acts depends on all joints"
    not_undone = "it is in what the robot touches, not in a joint"

    def add(self, spec: mujoco.MjSpec, place: str, *values: float) -> None:
        body = spec.body(place)
        if body is None:
            raise BadInput(f"effect on body {place!r}", "a body of the model", "no body of this name")
        height, *at, friction = values
        point, plane = native.contact_names(place)
        silent: dict[str, Any] = {"contype": 0, "conaffinity": 0}
        size = [native.POINT_RADIUS, 0, 0]
        body.add_geom(name=point, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=size, pos=at, mass=0, **silent)
        flat = {"type": mujoco.mjtGeom.mjGEOM_PLANE, "size": [0, 0, 1], "pos": [0, 0, height]}
        spec.worldbody.add_geom(name=plane, **flat, **silent)
        bare_pair(spec, geomname1=point, geomname2=plane, condim=3, friction=[friction, friction, *_ROLLING])

    def write(self, spot: Spot, *values: float) -> None:
        model, (height, *at, friction) = spot.model, values
        point, plane = (int(model.geom(name).id) for name in native.contact_names(spot.place))
        model.geom_pos[point], model.geom_pos[plane] = at, (0.0, 0.0, height)
        pairs = np.flatnonzero((np.stack((model.pair_geom1, model.pair_geom2)) == point).any(axis=0))
        model.pair_friction[pairs, :2] = friction

    def declared(self, spot: Spot) -> Sequence[float]:
        return (native.NO_SURFACE, *spot.model.body(spot.place).ipos, 1.0)

    def bounds(self, nominal: Sequence[float], limits: Any) -> tuple[np.ndarray, np.ndarray]:
        low, high = super().bounds(nominal, limits)
        high[-1] = limits.contact_friction
        return low, high
