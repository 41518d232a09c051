"""Gravity feed-forward: how far a servo's target must lead the reference for the motor to carry the reference pose.

Quasi-static, from the clip and the declared model alone, so that the robot can compute it too: gravity's torque less
that of the feet's support, which carries the weight under the centre of mass.
"""

from functools import cache

import mujoco
import numpy as np

from bumblebee.motion.clip import Clip
from bumblebee.motion.contacts import foot_contacts
from bumblebee.motion.kinematics import sole_points
from bumblebee.robot.facts import columns, joints, limb
from bumblebee.robot.model import build_model, gains
from bumblebee.robot.written import SIDES

_LARGEST = 1.0  # rad
_SMOOTH = 5  # frames over which a change of the supporting foot is spread
_LEG = {side: columns(limb(side, "foot")) for side in SIDES}  # columns of the legs' joints


def lead_angles(clip: Clip) -> np.ndarray:
    """Angle [rad] by which each joint's target leads the reference, (T, 23) float32: static torque over servo gain."""
    kp = np.array([gains(joint)[0] for joint in joints()])
    return np.clip(static_torques(clip) / kp, -_LARGEST, _LARGEST).astype(np.float32)


def static_torques(clip: Clip, model: mujoco.MjModel | None = None) -> np.ndarray:
    """Torques (T, 23) [N m] that hold each frame of the clip at rest on the feet that touch the floor in it.

    Args:
        clip: T frames.
        model: a G1 of other masses than the declared one's.
    """
    model = _model() if model is None else model
    data = mujoco.MjData(model)
    count, joint_count = clip.frames, clip.joint_pos.shape[1]
    gravity = np.zeros((count, joint_count))
    axis, anchor = np.zeros((count, joint_count, 3)), np.zeros((count, joint_count, 3))
    com = np.zeros((count, 3))
    full = np.zeros(model.nv)
    for t in range(count):
        data.qpos[:] = np.concatenate((clip.root_pos[t], clip.root_quat[t], clip.joint_pos[t]))
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_rne(model, data, 0, full)
        gravity[t], axis[t], anchor[t], com[t] = full[6:], data.xaxis[1:], data.xanchor[1:], data.subtree_com[1]
    place, share = supports(clip, com)
    up = np.array([0.0, 0.0, float(model.body_subtreemass[1]) * 9.81])
    torque = gravity
    for foot, leg in enumerate(_LEG.values()):
        force = share[:, foot, None, None] * up  # (T, 1, 3)
        lever = place[:, foot, None] - anchor[:, leg]
        torque[:, leg] -= (axis[:, leg] * np.cross(lever, force)).sum(-1)
    return torque


def supports(clip: Clip, com: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the floor pushes on each foot, (T, 2, 3) [m], and each foot's share of the weight, (T, 2).

    Args:
        clip: T frames.
        com: (T, 3) [m] centre of mass.
    """
    soles = sole_points(clip.root_pos, clip.root_quat, clip.joint_pos)  # (T, 2, 4, 3)
    centre = soles.mean(axis=2)
    touching = foot_contacts(clip)
    line = centre[:, 1, :2] - centre[:, 0, :2]
    along = ((com[:, :2] - centre[:, 0, :2]) * line).sum(-1) / np.maximum((line**2).sum(-1), 1e-6)
    right = np.clip(along, 0.0, 1.0)
    both = touching[:, 0] & touching[:, 1]
    share = np.where(both[:, None], np.stack((1 - right, right), axis=1), touching.astype(float))
    share = _smoothed(share)
    carried = (share[..., None] * centre).sum(1) / np.maximum(share.sum(1), 1e-6)[:, None]
    shift = np.where(share.sum(1)[:, None] > 0.5, com[:, :2] - carried[:, :2], 0.0)
    place = centre.copy()
    place[..., :2] = np.clip(centre[..., :2] + shift[:, None], soles[..., :2].min(2), soles[..., :2].max(2))
    return place, share


def _smoothed(values: np.ndarray) -> np.ndarray:
    """Moving average over time of (T, N)."""
    padded = np.pad(values, ((_SMOOTH // 2, _SMOOTH // 2), (0, 0)), mode="edge")
    return np.stack([padded[i : i + len(values)] for i in range(_SMOOTH)]).mean(axis=0)


@cache
def _model() -> mujoco.MjModel:
    return build_model()
