"""Geometries that nothing can touch within a window: without them a step costs less and comes out the same.

A standing robot touches the floor with its feet. Its head is tested against the floor in every step all the same.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from weakref import WeakKeyDictionary

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.diagnosis.simulation.starts.base_height import lowest, moving_and_colliding
from bumblebee.diagnosis.simulation.windows import Windows

_known: WeakKeyDictionary[Windows, np.ndarray] = WeakKeyDictionary()

_LEVEL = 1e-6
"""By how much the cosine of a floor's slope may lack of 1."""


def out_of_reach(plant: Plant, windows: Windows) -> np.ndarray:
    """Ids (K,) of geometries that can touch floors alone and are too far above them at the start of every window."""
    if windows not in _known:
        _known[windows] = _found(plant, windows)
    return _known[windows]


@contextmanager
def without(models: Sequence[mujoco.MjModel], geoms: np.ndarray) -> Iterator[None]:
    """`models` with `geoms` taken out of all collisions, and as they were afterwards."""
    before = [(model, model.geom_contype[geoms].copy(), model.geom_conaffinity[geoms].copy()) for model in models]
    try:
        for model in models:
            model.geom_contype[geoms], model.geom_conaffinity[geoms] = 0, 0
        yield
    finally:
        for model, kind, affinity in before:
            model.geom_contype[geoms], model.geom_conaffinity[geoms] = kind, affinity


def _found(plant: Plant, windows: Windows) -> np.ndarray:
    model, rule = plant.model, plant.thresholds.culling
    moving = moving_and_colliding(model)
    fixed = [g for g in range(model.ngeom) if model.body_weldid[model.geom_bodyid[g]] == 0 and _collides(model, g)]
    some = [g for g in moving if not any(_meet(model, g, other) for other in moving if other != g)]
    some = [g for g in some if g not in (*model.pair_geom1, *model.pair_geom2)]
    if not some:
        return np.empty(0, dtype=int)
    data, plane = mujoco.MjData(model), int(mujoco.mjtGeom.mjGEOM_PLANE)
    mujoco.mj_kinematics(model, data)
    if not all(model.geom_type[g] == plane and data.geom_xmat[g, 8] > 1 - _LEVEL for g in fixed):
        return np.empty(0, dtype=int)
    floor = max((data.geom_xpos[g, 2] for g in fixed), default=-np.inf)
    clear = np.full(len(some), np.inf)
    for qpos in windows.qpos:
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        clear = np.minimum(clear, [lowest(model, data, g) - floor for g in some])
    return np.array(some, dtype=int)[clear > rule.fastest * windows.span]


def _collides(model: mujoco.MjModel, geom: int) -> bool:
    return bool(model.geom_contype[geom] | model.geom_conaffinity[geom])


def _meet(model: mujoco.MjModel, a: int, b: int) -> bool:
    """Whether two geometries may collide by their types."""
    kind, affinity = model.geom_contype, model.geom_conaffinity
    return bool((kind[a] & affinity[b]) | (kind[b] & affinity[a]))
