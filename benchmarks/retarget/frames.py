"""Orientations of the limbs from landmarks alone: frame-by-frame IK wants them, and mocap files may not have them."""

import numpy as np

from bumblebee.motion.human.motion import LANDMARKS

_STRAIGHT = 0.15  # sine of the bend below which a hinge's axis is not told by the limb


def orientations(positions: np.ndarray) -> dict[str, np.ndarray]:
    """Rotation matrices (T, 3, 3), body to world, of the G1's bodies that follow the landmarks (T, 18, 3).

    Axes as the G1 has them with all joints at 0: x ahead, y left, z up; the forearm points ahead.
    """
    at = {name: positions[:, number] for number, name in enumerate(LANDMARKS)}
    pelvis = _frame(up=at["chest"] - at["pelvis"], left=at["left_hip"] - at["right_hip"], keep="left")
    torso = _frame(up=at["neck"] - at["pelvis"], left=at["left_shoulder"] - at["right_shoulder"], keep="up")
    found = {"pelvis": pelvis, "torso_link": torso}
    for side in ("left", "right"):
        hip, knee, ankle, toe = (at[f"{side}_{part}"] for part in ("hip", "knee", "ankle", "toe"))
        shoulder, elbow, wrist = (at[f"{side}_{part}"] for part in ("shoulder", "elbow", "wrist"))
        ahead = toe - ankle
        hinge = _hinge(hip - knee, knee - ankle, _cross(hip - ankle, ahead))
        found[f"{side}_hip_roll_link"] = _frame(up=hip - knee, left=hinge, keep="up")
        found[f"{side}_knee_link"] = _frame(up=knee - ankle, left=hinge, keep="up")
        found[f"{side}_ankle_roll_link"] = _foot(ahead, hinge, ankle, toe)
        bend = _hinge(shoulder - elbow, wrist - elbow, torso[..., 1])
        found[f"{side}_shoulder_yaw_link"] = _frame(up=shoulder - elbow, left=bend, keep="up")
        fore = _unit(wrist - elbow)
        found[f"{side}_elbow_link"] = found[f"{side}_wrist_yaw_link"] = _columns(fore, bend)
    return found


def _foot(ahead: np.ndarray, hinge: np.ndarray, ankle: np.ndarray, toe: np.ndarray) -> np.ndarray:
    """The sole's frame: from ankle to toe, raised by the slope that this line has where the foot stands."""
    level = np.argsort(ankle[:, 2] + toe[:, 2])[: max(1, len(ankle) // 5)]
    slope = float(np.median(np.arctan2(-ahead[level, 2], np.linalg.norm(ahead[level, :2], axis=-1))))
    frame = _columns(_unit(ahead), hinge)
    raised = np.array([[np.cos(slope), 0, -np.sin(slope)], [0, 1, 0], [np.sin(slope), 0, np.cos(slope)]])
    return frame @ raised


def _hinge(first: np.ndarray, second: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    """The axis (T, 3) about which two parts of a limb bend; `otherwise` where the limb is straight."""
    axis = _cross(_unit(first), _unit(second))
    axis = np.where(np.sum(axis * otherwise, axis=-1, keepdims=True) < 0, -axis, axis)
    share = np.clip(np.linalg.norm(axis, axis=-1, keepdims=True) / _STRAIGHT - 1, 0, 1)
    return _unit(share * _unit(axis) + (1 - share) * _unit(otherwise))


def _frame(up: np.ndarray, left: np.ndarray, keep: str) -> np.ndarray:
    """Columns x ahead, y left, z up; of the two directions `keep` stays as it is."""
    up, left = _unit(up), _unit(left)
    ahead = _unit(_cross(left, up))
    up, left = (up, _cross(up, ahead)) if keep == "up" else (_cross(ahead, left), left)
    return np.stack([ahead, left, up], axis=-1)


def _columns(ahead: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Column x as given, y as near as can be."""
    up = _unit(_cross(ahead, left))
    return np.stack([ahead, _cross(up, ahead), up], axis=-1)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.cross(a, b)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.maximum(np.linalg.norm(vector, axis=-1, keepdims=True), 1e-9)
