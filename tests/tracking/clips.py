"""Small clips for the tests of tracking and learning."""

import numpy as np

from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import make_clip
from bumblebee.robot.facts import joint_names, stand_pose
from bumblebee.robot.model import build_model


def waving(name: str = "wave", frames: int = 60, size: float = 0.3, speed: float = 0.0, family: str = "stand") -> Clip:
    """A stand that swings its shoulders by `size` [rad] and slides ahead at `speed` [m/s]."""
    time = np.arange(frames) / 50
    pose = np.tile(stand_pose(), (frames, 1))
    for index, joint in enumerate(joint_names()):
        if "shoulder_pitch" in joint:
            pose[:, index] += size * np.sin(2 * np.pi * 0.5 * time)
    root = np.tile(build_model().key_qpos[0, :3], (frames, 1))
    root[:, 0] += speed * time
    return make_clip(name, 50.0, root, np.tile([1.0, 0, 0, 0], (frames, 1)), pose, family=family)
