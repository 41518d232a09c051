"""Poses and velocities of all bodies of the G1 in a clip, as simulators log them."""

from dataclasses import dataclass

import numpy as np

from bumblebee import quaternions
from bumblebee.motion.clip import Clip, velocities
from bumblebee.motion.kinematics import forward_bodies
from bumblebee.robot.facts import joint_names, robot_bodies


@dataclass(frozen=True)
class BodyMotion:
    """Motion of the 30 bodies depth-first, the pelvis first; velocities are of the bodies' frames, not of their masses.

    `pos` (T, 30, 3) [m, world], `quat` (T, 30, 4) [wxyz, body to world], `lin_vel` (T, 30, 3) [m/s, world],
    `ang_vel` (T, 30, 3) [rad/s, world].
    """

    pos: np.ndarray
    quat: np.ndarray
    lin_vel: np.ndarray
    ang_vel: np.ndarray


def body_motion(clip: Clip) -> BodyMotion:
    """From the clip's joints and root and their central differences, carried from each body to the next."""
    poses = forward_bodies(clip.root_pos, clip.root_quat, clip.joint_pos)
    rates = velocities(clip)
    linear: dict[str, np.ndarray] = {}
    angular: dict[str, np.ndarray] = {}
    for name, facts in robot_bodies().items():
        pos, quat = poses[name]
        if facts["parent"] not in poses:
            linear[name] = rates.root_lin_vel_w.astype(np.float64)
            angular[name] = quaternions.rotate(quat, rates.root_ang_vel_b)
            continue
        above = facts["parent"]
        linear[name] = linear[above] + _cross(angular[above], pos - poses[above][0])
        angular[name] = angular[above] + _turning(facts, quat, rates.joint_vel)
    order = list(robot_bodies())
    stacked = [np.stack([poses[name][part] for name in order], axis=1) for part in (0, 1)]
    return BodyMotion(*stacked, *(np.stack([of[name] for name in order], axis=1) for of in (linear, angular)))


def _turning(facts: dict, quat: np.ndarray, joint_vel: np.ndarray) -> np.ndarray:
    """Angular velocity that a body's own joint adds, (T, 3) [rad/s, world]; the wrists are locked."""
    joint = facts.get("joint")
    if joint is None or joint["name"] not in joint_names():
        return np.zeros(3)
    rate = joint_vel[:, joint_names().index(joint["name"])].astype(np.float64)
    return rate[:, None] * quaternions.rotate(quat, np.asarray(joint["axis"], np.float64))


def _cross(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    (a, b, c), (x, y, z) = left.T, right.T
    return np.stack([b * z - c * y, c * x - a * z, a * y - b * x], axis=1)
