"""A clip's arrays as columns of one table, a row a frame."""

from functools import cache
from typing import Any

import numpy as np

from bumblebee.motion.clip import Clip
from bumblebee.robot.facts import KEY_BODIES, joint_names


@cache
def columns() -> tuple[str, ...]:
    """Names of the 72 columns: pelvis [m], its quaternion wxyz, joints [rad], keypoints [m]."""
    keys = [f"{body}_{axis}" for body in KEY_BODIES for axis in "xyz"]
    return (*(f"root_{a}" for a in "xyz"), *(f"root_q{a}" for a in "wxyz"), *joint_names(), *keys)


def table_of(clip: Clip) -> np.ndarray:
    """The clip's arrays side by side, (T, 72), float32."""
    keys = clip.key_pos.reshape(clip.frames, -1)
    return np.concatenate([clip.root_pos, clip.root_quat, clip.joint_pos, keys], axis=1, dtype=np.float32)


def arrays_of(table: np.ndarray) -> dict[str, Any]:
    """The fields of `Clip` that are arrays, from such a table (T, 72); each is a copy."""
    root_pos, root_quat, joint_pos, key_pos = np.split(table, [3, 7, 7 + len(joint_names())], axis=1)
    key_pos = key_pos.reshape(-1, len(KEY_BODIES), 3)
    arrays = {"root_pos": root_pos, "root_quat": root_quat, "joint_pos": joint_pos, "key_pos": key_pos}
    return {name: np.array(values, dtype=np.float32, order="C") for name, values in arrays.items()}
