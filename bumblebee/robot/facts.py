"""The Unitree G1 as data: joints in the field's order, their limits and motors, the bodies that are tracked.

The 23 actuated joints are the 29 without the six wrist joints (paper, section 4.1); that is not the
hardware variant which Unitree sells as "23 DoF".
"""

from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
import yaml

ROBOT = "g1_23dof"  # as exported policies and compensations name it
WRIST_JOINTS = tuple(f"{side}_wrist_{axis}_joint" for side in ("left", "right") for axis in ("roll", "pitch", "yaw"))
ANKLE_JOINTS = tuple(f"{side}_ankle_{axis}_joint" for side in ("left", "right") for axis in ("pitch", "roll"))
FEET = ("left_ankle_roll_link", "right_ankle_roll_link")

# The 14 bodies whose positions are tracked ("keypoints"): pelvis, hips, knees, feet, torso, shoulders, elbows, hands.
KEY_BODIES = (
    "pelvis",
    "left_hip_roll_link",
    "left_knee_link",
    "left_ankle_roll_link",
    "right_hip_roll_link",
    "right_knee_link",
    "right_ankle_roll_link",
    "torso_link",
    "left_shoulder_roll_link",
    "left_elbow_link",
    "left_wrist_yaw_link",
    "right_shoulder_roll_link",
    "right_elbow_link",
    "right_wrist_yaw_link",
)

# A relaxed stand with slightly bent knees [rad]; joints that are not named stand at 0.
STAND_POSE = {
    "hip_pitch": -0.1,
    "knee": 0.3,
    "ankle_pitch": -0.2,
    "shoulder_pitch": 0.2,
    "left_shoulder_roll": 0.2,
    "right_shoulder_roll": -0.2,
    "elbow": 0.6,
}


@dataclass(frozen=True)
class Joint:
    """One actuated hinge: `range` [rad], `effort_limit` [N m], `velocity_limit` [rad/s], `armature` [kg m^2]."""

    name: str
    axis: tuple[float, float, float]
    range: tuple[float, float]
    motor: str
    effort_limit: float
    velocity_limit: float
    armature: float


@cache
def g1_bodies() -> dict[str, dict[str, Any]]:
    """The table itself: body name -> parent, pose, inertia, joint, collision primitives, sites; parents come first."""
    return yaml.safe_load(files("bumblebee.robot").joinpath("g1.yaml").read_text())["bodies"]


@cache
def joints(dof: int = 23) -> tuple[Joint, ...]:
    """The G1's joints in Unitree's order, all 29 or the 23 that are actuated here."""
    every = [Joint(**_tuples(body["joint"])) for body in g1_bodies().values() if "joint" in body]
    return tuple(j for j in every if dof == 29 or j.name not in WRIST_JOINTS)


def joint_names(dof: int = 23) -> tuple[str, ...]:
    """Names of `joints(dof)`, which is the column order of every array of joint values."""
    return tuple(joint.name for joint in joints(dof))


def stand_pose(dof: int = 23) -> np.ndarray:
    """Joint angles of the relaxed stand, (dof,) [rad]."""

    def angle(name: str) -> float:
        stem = name.removesuffix("_joint")
        return STAND_POSE.get(stem, STAND_POSE.get(stem.split("_", 1)[1], 0.0))

    return np.array([angle(name) for name in joint_names(dof)])


def _tuples(table: dict[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in table.items()}
