"""Demands of a jump on the robot: take-off speed, rise, and the torques of its push-off by inverse dynamics.

The floor's forces on the soles that are near it are those that explain the root's motion with small joint torques
(non-negative least squares over the edges of friction pyramids); what the joints must add is what the reference needs.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import nnls

from bumblebee.motion.clip import Clip, differences
from bumblebee.motion.kinematics import lowest, sole_points
from bumblebee.robot.facts import FEET, joint_names, joints
from bumblebee.robot.model import build_model

HEIGHT = 0.05  # m: lowest point of the robot beyond which it flies
SHORTEST = 8  # frames
PUSH_OFF = 20  # frames before take-off
NEAR = 0.06  # m: soles lower than this may be pushed by the floor
FRICTION = 0.9
LEGS = 12
_SMOOTH = 1.5  # frames, standard deviation of the Gaussian before differences are taken
_REGULAR = 0.01  # weight of joint torques, in parts of their limits, beside the root's wrench
_ANGULAR = 3.0  # weight of a moment [N m] beside a force [N]


@dataclass(frozen=True)
class Flight:
    """A stretch in which the reference touches nothing."""

    start: int
    end: int
    """First frame in the air, and the first one after it."""
    height: float
    """Largest height of the lowest point [m]."""
    speed: float
    """Upward speed of the centre of mass at take-off [m/s]."""
    acceleration: float
    """Vertical acceleration of the centre of mass in flight, of a parabola through it [m/s^2]; -9.81 is a free fall."""
    torque: float
    """Largest torque of a leg's joint in the push-off, in parts of its limit; NaN where no sole was near the floor."""
    joint: str
    """The joint that needs it."""
    frames_over: int
    """Frames of the push-off in which some leg joint needs more than its limit."""


def flights(clip: Clip, height: float = 0.1) -> list[Flight]:
    """The clip's flights that rise above `height` [m] and last at least 0.16 s at 50 Hz."""
    low = lowest(clip.root_pos, clip.root_quat, clip.joint_pos)
    edges = np.flatnonzero(np.diff(np.r_[0, (low > HEIGHT).astype(int), 0]))
    wanted = [
        (s, e) for s, e in zip(edges[::2], edges[1::2], strict=True) if e - s >= SHORTEST and low[s:e].max() > height
    ]
    if not wanted:
        return []
    com = centre_of_mass(clip)
    speed = differences(gaussian_filter1d(com, 1.0, axis=0, mode="nearest"), clip.fps)
    found = []
    for start, end in wanted:
        ratio = push_off(clip, start)
        worst = np.unravel_index(int(ratio.argmax()), ratio.shape) if ratio.size else None
        time = np.arange(end - start) / clip.fps
        found.append(
            Flight(
                start=int(start),
                end=int(end),
                height=float(low[start:end].max()),
                speed=float(speed[start, 2]),
                acceleration=float(2 * np.polyfit(time, com[start:end, 2], 2)[0]),
                torque=float(ratio.max()) if worst is not None else float("nan"),
                joint=joint_names()[worst[1]] if worst is not None else "",
                frames_over=int((ratio > 1).any(axis=1).sum()) if worst is not None else 0,
            )
        )
    return found


def centre_of_mass(clip: Clip) -> np.ndarray:
    """(T, 3) [m] in the world."""
    model = build_model()
    data = mujoco.MjData(model)
    com = np.zeros((clip.frames, 3))
    for t in range(clip.frames):
        data.qpos[:] = np.concatenate((clip.root_pos[t], clip.root_quat[t], clip.joint_pos[t]))
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        com[t] = data.subtree_com[1]
    return com


def push_off(clip: Clip, start: int) -> np.ndarray:
    """Torques of the legs' joints in parts of their limits, (N, 12), of the frames before `start` that have support."""
    first = max(start - PUSH_OFF, 2)
    torque = needed_torques(clip, range(first, start))
    limit = np.array([joint.effort_limit for joint in joints()], dtype=float)
    return np.abs(torque)[:, :LEGS] / limit[:LEGS]


def needed_torques(clip: Clip, frames: range) -> np.ndarray:
    """Joint torques (N, 23) [N m] of those of `frames` in which a sole is near the floor."""
    model = build_model()
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data = mujoco.MjData(model)
    qpos, qvel, qacc = _motion(model, clip)
    soles = sole_points(qpos[:, :3], qpos[:, 3:7], qpos[:, 7:])  # (T, 2, 4, 3)
    limit = np.array([joint.effort_limit for joint in joints()], dtype=float)
    weight = np.r_[np.ones(3), np.full(3, _ANGULAR)]
    torques = []
    for t in frames:
        data.qpos[:], data.qvel[:], data.qacc[:] = qpos[t], qvel[t], qacc[t]
        mujoco.mj_inverse(model, data)
        force = data.qfrc_inverse.copy()
        edges = _pyramids(model, data, soles[t])
        if edges is None:
            continue
        small = _REGULAR * model.body_subtreemass[1] / limit
        system = np.vstack((edges[:6] * weight[:, None], edges[6:] * small[:, None]))
        pushed, _ = nnls(system, np.r_[force[:6] * weight, force[6:] * small])
        torques.append(force[6:] - edges[6:] @ pushed)
    return np.array(torques).reshape(-1, len(limit))


def _motion(model: mujoco.MjModel, clip: Clip) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """qpos, qvel and qacc of the smoothed clip, by central differences."""
    qpos = np.concatenate((clip.root_pos, clip.root_quat, clip.joint_pos), axis=1).astype(float)
    qpos = gaussian_filter1d(qpos, _SMOOTH, axis=0, mode="nearest")
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    qvel = np.zeros((len(qpos), model.nv))
    for t in range(1, len(qpos) - 1):
        mujoco.mj_differentiatePos(model, qvel[t], 2 / clip.fps, qpos[t - 1], qpos[t + 1])
    return qpos, qvel, np.gradient(qvel, 1 / clip.fps, axis=0)


def _pyramids(model: mujoco.MjModel, data: mujoco.MjData, soles: np.ndarray) -> np.ndarray | None:
    """Generalised forces (6 + J, N) of unit pushes along the edges of the friction pyramids; None without support."""
    columns = []
    for foot, points in zip(FEET, soles, strict=True):
        for point in points[points[:, 2] < NEAR]:
            jacobian = np.zeros((3, model.nv))
            mujoco.mj_jac(model, data, jacobian, None, point, model.body(foot).id)
            for x, y in ((FRICTION, 0), (-FRICTION, 0), (0, FRICTION), (0, -FRICTION)):
                columns.append(jacobian.T @ np.array([x, y, 1.0]))
    return np.array(columns).T if columns else None
