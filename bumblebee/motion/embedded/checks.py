"""Is a motion physically possible? Feet, balance, contact forces, torques and self-collision, in numbers."""

from dataclasses import dataclass
from functools import cache

import mujoco
import numpy as np
from scipy.optimize import nnls
from scipy.spatial import ConvexHull

from bumblebee.motion.clip import Clip
from bumblebee.motion.embedded.solver import floor_wrench, plain_model
from bumblebee.motion.kinematics import sole_points
from bumblebee.robot.facts import FEET, joints
from bumblebee.robot.model import RobotConfig, build_model

FRICTION = 0.7
WEIGHT_OF_TORQUE = 1e-3
"""How much smaller torques count against the contact forces' error; small, as it only settles what is open."""


@dataclass(frozen=True)
class Loads:
    """Loads of the floor and the motors, for the frames looked at (K of them)."""

    frames: np.ndarray
    """(K,) frame numbers."""
    missing: np.ndarray
    """(K, 6) force [N] and moment about the centre of mass [N m] that no contact force can supply."""
    torque: np.ndarray
    """(K, 23) share of each motor's limit."""


def qpos_of(clip: Clip) -> np.ndarray:
    """The clip as `qpos` (T, 30) in float64."""
    return np.concatenate([clip.root_pos, clip.root_quat, clip.joint_pos], axis=1).astype(np.float64)


def soles(clip: Clip) -> np.ndarray:
    """The soles' corners, (T, 2, 4, 3) [m, world]."""
    return sole_points(clip.root_pos, clip.root_quat, clip.joint_pos)


def com(clip: Clip) -> np.ndarray:
    """Centre of mass (T, 3) [m, world]."""
    model = plain_model()
    data = mujoco.MjData(model)
    out = np.empty((clip.frames, 3))
    for k, qpos in enumerate(qpos_of(clip)):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        out[k] = data.subtree_com[1]
    return out


def inside(point: np.ndarray, corners: np.ndarray) -> float:
    """How far a point (2,) lies inside the convex hull of corners (N, 2) [m]; negative outside."""
    hull = ConvexHull(corners)
    return float(-np.max(hull.equations[:, :2] @ point + hull.equations[:, 2]))


def support_margin(points: np.ndarray, corners: np.ndarray, contact: np.ndarray) -> np.ndarray:
    """`inside` of points (T, 2) for the soles (T, 2, 4, 3) in contact (T, 2); NaN in the air."""
    margin = np.full(len(points), np.nan)
    for k in np.flatnonzero(contact.any(axis=1)):
        margin[k] = inside(points[k], corners[k, contact[k]].reshape(-1, 3)[:, :2])
    return margin


def loads(clip: Clip, contact: np.ndarray, every: int = 1) -> Loads:
    """Contact forces within friction cones at the soles' corners, and the torques that remain for the motors.

    Args:
        clip: the motion.
        contact: (T, 2) bool, which sole carries.
        every: look at every n-th frame.
    """
    model = plain_model()
    data = mujoco.MjData(model)
    qpos = qpos_of(clip)
    limits = np.array([joint.effort_limit for joint in joints()])
    wrench, generalised = floor_wrench(qpos)
    corners = soles(clip)
    frames = np.arange(0, clip.frames, every)
    missing, torque = np.zeros((len(frames), 6)), np.zeros((len(frames), len(limits)))
    for row, k in enumerate(frames):
        data.qpos[:] = qpos[k]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        middle = data.subtree_com[1].copy()
        need = np.concatenate([wrench[k, :3], wrench[k, 3:] - np.cross(middle, wrench[k, :3])])
        arms, onto_joints = _contact_maps(model, data, corners[k], contact[k], middle)
        if arms.shape[1] == 0:
            missing[row], torque[row] = need, generalised[k, 6:] / limits
            continue
        scaled = WEIGHT_OF_TORQUE * 330 / limits[:, None]
        stacked = np.vstack([arms, scaled * onto_joints])
        force, _ = nnls(stacked, np.concatenate([need, scaled[:, 0] * generalised[k, 6:]]), maxiter=500)
        missing[row] = need - arms @ force
        torque[row] = (generalised[k, 6:] - onto_joints @ force) / limits
    return Loads(frames, missing, torque)


def _contact_maps(
    model: mujoco.MjModel, data: mujoco.MjData, corners: np.ndarray, contact: np.ndarray, middle: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Maps from the friction cones' edges, 4 a corner, to the wrench about `middle` (6, N) and the joints (23, N)."""
    edges = np.array([[FRICTION, 0, 1], [-FRICTION, 0, 1], [0, FRICTION, 1], [0, -FRICTION, 1]]).T
    wrenches, torques = [np.empty((6, 0))], [np.empty((model.nv - 6, 0))]
    jacobian = np.zeros((3, model.nv))
    for foot in np.flatnonzero(contact):
        body = model.body(FEET[foot]).id
        for point in corners[foot]:
            mujoco.mj_jac(model, data, jacobian, None, point, body)
            wrenches.append(np.vstack([edges, np.cross((point - middle)[None], edges.T).T]))
            torques.append(jacobian[:, 6:].T @ edges)
    return np.hstack(wrenches), np.hstack(torques)


@cache
def _colliding_model() -> mujoco.MjModel:
    return build_model(RobotConfig(self_collision=True))


def self_collisions(clip: Clip, every: int = 5) -> dict[tuple[str, str], float]:
    """Pairs of the robot's own primitives that meet, and the deepest penetration of each [m]."""
    model = _colliding_model()
    data = mujoco.MjData(model)
    floor = model.geom("floor").id
    deepest: dict[tuple[str, str], float] = {}
    for qpos in qpos_of(clip)[::every]:
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        for contact in data.contact[: data.ncon]:
            if floor in contact.geom:
                continue
            pair = tuple(sorted(model.geom(i).name for i in contact.geom))
            deepest[pair] = max(deepest.get(pair, 0.0), -float(contact.dist))
    return deepest
