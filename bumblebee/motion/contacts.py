"""When a foot of a motion stands on the floor."""

import numpy as np

from bumblebee.motion.clip import Clip, differences
from bumblebee.motion.kinematics import sole_points

_CONTACT_HEIGHT = 0.03  # m: a sole lower than this may touch the floor
_CONTACT_SPEED = 0.5  # m/s: and does, if it moves slower than this


def foot_contacts(clip: Clip) -> np.ndarray:
    """Which foot stands on the floor, (T, 2) bool (left, right): a sole point that is low and slow."""
    points = sole_points(clip.root_pos, clip.root_quat, clip.joint_pos)  # (T, 2, 4, 3)
    speed = np.linalg.norm(differences(points, clip.fps), axis=-1)
    return np.any((points[..., 2] < _CONTACT_HEIGHT) & (speed < _CONTACT_SPEED), axis=-1)
