"""The landmarks of a person found on the robot, and a person scaled to the robot's size."""

import numpy as np

from bumblebee import quaternions
from bumblebee.motion.clip import Clip
from bumblebee.motion.human.motion import LANDMARKS, HumanMotion
from bumblebee.motion.kinematics import forward_bodies

# Where each landmark lies: a body, and a place in its frame [m].
_ON_ROBOT: dict[str, tuple[str, tuple[float, float, float]]] = {
    "pelvis": ("pelvis", (0.0, 0.0, 0.0)),
    "chest": ("torso_link", (0.0, 0.0, 0.14)),
    "neck": ("torso_link", (0.0, 0.0, 0.30)),
    "head": ("torso_link", (0.0, 0.0, 0.43)),
}
for _side in ("left", "right"):
    _ON_ROBOT |= {
        f"{_side}_hip": (f"{_side}_hip_roll_link", (0.0, 0.0, 0.0)),
        f"{_side}_knee": (f"{_side}_knee_link", (0.0, 0.0, 0.0)),
        f"{_side}_ankle": (f"{_side}_ankle_roll_link", (0.0, 0.0, 0.0)),
        f"{_side}_toe": (f"{_side}_ankle_roll_link", (0.12, 0.0, -0.025)),
        f"{_side}_shoulder": (f"{_side}_shoulder_roll_link", (0.0, 0.0, 0.0)),
        f"{_side}_elbow": (f"{_side}_elbow_link", (0.0, 0.0, 0.0)),
        f"{_side}_wrist": (f"{_side}_wrist_yaw_link", (0.0, 0.0, 0.0)),
    }
LEG = (("hip", "knee"), ("knee", "ankle"))
ARM = (("shoulder", "elbow"), ("elbow", "wrist"))


def robot_landmarks(root_pos: np.ndarray, root_quat: np.ndarray, joint_pos: np.ndarray) -> np.ndarray:
    """`LANDMARKS` on the G1, (T, 18, 3) [m, world]; joint centres are the origins of the bodies that follow them."""
    poses = forward_bodies(root_pos, root_quat, joint_pos)
    places = [_ON_ROBOT[name] for name in LANDMARKS]
    return np.stack([poses[body][0] + quaternions.rotate(poses[body][1], place) for body, place in places], axis=1)


def person_of(clip: Clip) -> HumanMotion:
    """The robot's own landmarks as if they were a person's: a motion that can be followed exactly."""
    positions = robot_landmarks(clip.root_pos, clip.root_quat, clip.joint_pos)
    return HumanMotion(clip.name, clip.fps, positions, file=clip.name)  # type: ignore[arg-type]


def length(positions: np.ndarray, parts: tuple[tuple[str, str], ...]) -> float:
    """Median length of a limb over time, both sides [m]."""
    at = {name: positions[:, number] for number, name in enumerate(LANDMARKS)}
    sides = [
        sum(np.linalg.norm(at[f"{side}_{first}"] - at[f"{side}_{second}"], axis=-1) for first, second in parts)
        for side in ("left", "right")
    ]
    return float(np.median(np.concatenate(sides)))


def trunk(positions: np.ndarray) -> float:
    """Median distance of the pelvis from the middle of the shoulders [m]."""
    at = {name: positions[:, number] for number, name in enumerate(LANDMARKS)}
    middle = (at["left_shoulder"] + at["right_shoulder"]) / 2
    return float(np.median(np.linalg.norm(middle - at["pelvis"], axis=-1)))


def scaled(positions: np.ndarray) -> np.ndarray:
    """A person (T, 18, 3) of the robot's size: the pelvis about the origin by the legs' length, legs by it, too.

    What lies above the pelvis is scaled about it by the length of trunk and arm.
    """
    zero = robot_landmarks(np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0, 0.0]]), np.zeros((1, 23)))
    legs = length(zero, LEG) / length(positions, LEG)
    above = (trunk(zero) + length(zero, ARM)) / (trunk(positions) + length(positions, ARM))
    pelvis = positions[:, :1]
    lower = [name == "pelvis" or name.endswith(("hip", "knee", "ankle", "toe")) for name in LANDMARKS]
    factor = np.where(lower, legs, above)[:, None]
    return legs * pelvis + factor * (positions - pelvis)
