"""Ground reaction of a robot whose base is free: any force and moment on each body that touches."""

from collections.abc import Sequence

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation import Plant
from bumblebee.diagnosis.thresholds.sensitivities import Ground
from bumblebee.sim.nearness import touching_from


def pushes(plant: Plant, qpos: np.ndarray, rule: Ground) -> np.ndarray:
    """Generalised forces (W, S, nv, M) of unit forces and moments on bodies that touch the ground in poses (W, S, nq).

    M is six for each of as many bodies as touch at once; zeros where fewer do, and none where the base is fixed.
    """
    model, shape = plant.model, qpos.shape[:2]
    if not plant.floating:
        return np.zeros((*shape, model.nv, 0))
    near, data = touching_from(model, rule.touching), mujoco.MjData(model)
    each = []
    for pose in qpos.reshape(-1, qpos.shape[-1]):
        data.qpos[:] = pose
        mujoco.mj_kinematics(near, data)
        mujoco.mj_comPos(near, data)
        mujoco.mj_collision(near, data)
        each.append([_jacobian(model, data, body) for body in _touching(model, data, rule.touching)])
    out = np.zeros((len(each), model.nv, 6 * max(len(rows) for rows in each)))
    for part, rows in zip(out, each, strict=True):
        for k, row in enumerate(rows):
            part[:, 6 * k : 6 * k + 6] = row.T
    return out.reshape(*shape, model.nv, -1)


def without_push(torque: np.ndarray, ground: np.ndarray, plant: Plant) -> np.ndarray:
    """Generalised forces (W, S, nv) less the smallest push that leaves nothing on the base."""
    if not ground.shape[-1]:
        return torque
    base = slice(plant.base_dof, plant.base_dof + 6)
    push = np.linalg.pinv(ground[..., base, :]) @ torque[..., base, None]
    return torque - (ground @ push)[..., 0]


def basis_of(ground: np.ndarray) -> np.ndarray:
    """Orthogonal directions (N, nv, M) of pushes (N, nv, M), zeros where these are fewer."""
    if not ground.shape[-1]:
        return ground
    basis, size, _ = np.linalg.svd(ground, full_matrices=False)
    return basis * (size > 1e-9 * size.max(axis=-1, keepdims=True))[:, None]


def without(torques: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Torques (N, nv, P) less what lies in the directions of a basis (N, nv, M)."""
    return torques - basis @ (basis.transpose(0, 2, 1) @ torques) if basis.shape[-1] else torques


def _touching(model: mujoco.MjModel, data: mujoco.MjData, distance: float) -> Sequence[int]:
    """Bodies that are nearer than a distance [m] to what does not move."""
    pairs = model.geom_bodyid[data.contact.geom[data.contact.dist < distance]]
    still = model.body_weldid[pairs] == 0
    return sorted({int(b) for b in pairs[~still & still[:, ::-1]]})


def _jacobian(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> np.ndarray:
    """Force and moment (6, nv) at a body's frame."""
    force, moment = np.empty((3, model.nv)), np.empty((3, model.nv))
    mujoco.mj_jacBody(model, data, force, moment, body)
    return np.concatenate((force, moment))
