"""Height of a floating base without motion capture: the lowest collision geometry touches the floor."""

from collections.abc import Iterable, Sequence

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.nearness import colliding


def stance_heights(plant: Plant, rollouts: Sequence[Rollout], ids: Iterable[int]) -> dict[int, np.ndarray]:
    """Height of the base (T,) [m] at every tick of the rollouts `ids`, as if the lowest point always touched z = 0."""
    return {i: _heights(plant, rollouts[i]) for i in ids}


def _heights(plant: Plant, rollout: Rollout) -> np.ndarray:
    assert rollout.base_quat is not None  # the base is floating
    qpos = np.tile(plant.model.qpos0, (rollout.frames, 1))
    qpos[:, plant.base_qpos + 3 : plant.base_qpos + 7] = rollout.base_quat
    qpos[:, plant.qpos] = rollout.joint_pos
    return heights_of(plant, qpos)


def heights_of(plant: Plant, qpos: np.ndarray) -> np.ndarray:
    """Height of the base (...) [m] at which the lowest point of states (..., nq) touches z = 0, wherever they are."""
    model, data, depth = plant.model, mujoco.MjData(plant.model), plant.thresholds.base_height.rest_depth
    geoms = moving_and_colliding(model)
    out = np.zeros(qpos.shape[:-1])
    for at in np.ndindex(out.shape):
        data.qpos[:] = qpos[at]
        data.qpos[plant.base_qpos : plant.base_qpos + 3] = 0.0
        mujoco.mj_kinematics(model, data)
        out[at] = -min((lowest(model, data, g) for g in geoms), default=0.0) - depth
    return out


def moving_and_colliding(model: mujoco.MjModel) -> list[int]:
    """Ids of geometries of bodies that can move, which can touch something."""
    return np.flatnonzero(colliding(model) & (model.body_weldid[model.geom_bodyid] != 0)).tolist()


def lowest(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    """Lowest point of a geometry [m]: exact for spheres, capsules and boxes, from the bounding box else."""
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    up, z = data.geom_xmat[geom].reshape(3, 3)[2], data.geom_xpos[geom, 2]
    if kind == int(mujoco.mjtGeom.mjGEOM_SPHERE):
        return z - size[0]
    if kind == int(mujoco.mjtGeom.mjGEOM_CAPSULE):
        return z - size[0] - abs(up[2]) * size[1]
    centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    return float(z + up @ centre - np.abs(up) @ half)
