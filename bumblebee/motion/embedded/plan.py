"""A motion as task-space trajectories: what the feet, the weight, the pelvis and the arms shall do.

Times are seconds, positions metres, angles radians; the world's x points ahead of the first stand, z up,
the floor is z = 0. The feet stay level unless a plan pitches one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.robot.facts import joint_names, stand_pose

FPS = 50.0
UPPER_JOINTS = joint_names()[12:]
WAIST = {"yaw": 0, "roll": 1, "pitch": 2}
ARM_COLUMNS = {"left": slice(3, 7), "right": slice(7, 11)}
SIDES = ("left", "right")

# The relaxed stand of the declared model: ankle in the pelvis' frame, its height above the sole, pelvis height [m].
ANKLE_X, ANKLE_Y, ANKLE_Z = -0.0260, 0.1185, 0.035
PELVIS_HEIGHT = 0.7842
COM_HEIGHT = 0.6902
SOLE_CENTRE_X = 0.0409
"""Where the stand's centre of mass lies ahead of the ankles [m], 1 mm from the middle of the sole."""


@dataclass(frozen=True)
class Plan:
    """Trajectories at `FPS`, all of T frames; `height` is the pelvis' or, if `ballistic`, the centre of mass'."""

    foot_pos: np.ndarray
    """(T, 2, 3) ankle origins, left and right, world [m]."""
    foot_yaw: np.ndarray
    """(T, 2) [rad]."""
    foot_pitch: np.ndarray
    """(T, 2) toes down positive [rad]; zero in stance."""
    contact: np.ndarray
    """(T, 2) bool: the foot is meant to carry."""
    zmp: np.ndarray
    """(T, 2) where the floor's force shall act, world [m]."""
    height: np.ndarray
    """(T,) [m]."""
    pelvis: np.ndarray
    """(T, 3) yaw, pitch, roll of the pelvis [rad]."""
    upper: np.ndarray
    """(T, 11) waist and arm joints in joint order [rad]."""
    ballistic: bool = False
    """The height is the centre of mass' and may leave the floor."""

    @property
    def time(self) -> np.ndarray:
        """(T,) [s]."""
        return np.arange(len(self.height)) / FPS


def frames(seconds: float) -> int:
    """Number of frames that a duration spans."""
    return round(seconds * FPS)


def standing(seconds: float) -> Plan:
    """The relaxed stand, held."""
    count = frames(seconds) + 1
    feet = np.array([[ANKLE_X, ANKLE_Y, ANKLE_Z], [ANKLE_X, -ANKLE_Y, ANKLE_Z]])
    return Plan(
        foot_pos=np.tile(feet, (count, 1, 1)),
        foot_yaw=np.zeros((count, 2)),
        foot_pitch=np.zeros((count, 2)),
        contact=np.ones((count, 2), dtype=bool),
        zmp=np.tile([ANKLE_X + SOLE_CENTRE_X, 0.0], (count, 1)),
        height=np.full(count, PELVIS_HEIGHT),
        pelvis=np.zeros((count, 3)),
        upper=np.tile(stand_pose()[12:], (count, 1)),
    )


def ease(phase: np.ndarray) -> np.ndarray:
    """Minimum-jerk step: 0 before 0, 1 after 1, at rest to the second derivative at both ends."""
    s = np.clip(phase, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


def bump(phase: np.ndarray) -> np.ndarray:
    """0 -> 1 -> 0 over a phase of 0..1, at rest to the second derivative at both ends."""
    s = np.clip(phase, 0.0, 1.0)
    return 64 * s**3 * (1 - s) ** 3


def track(time: np.ndarray, keys: Sequence[tuple[float, object]]) -> np.ndarray:
    """Minimum-jerk moves between keys (time [s], value), held outside them: (T,) or (T, n) like the values."""
    values = [np.asarray(value, dtype=float) for _, value in keys]
    track_ = np.tile(values[0], (len(time),) + (1,) * values[0].ndim)
    for (start, _), (end, _), before, after in zip(keys, keys[1:], values, values[1:], strict=False):
        step = ease((time - start) / (end - start))
        track_ = track_ + np.multiply.outer(step, after - before)
    return track_


def swing(time: np.ndarray, start: float, end: float, cycles: int, rise: float = 0.5) -> np.ndarray:
    """(T,) whole cycles of a sine between two times, its amplitude eased in and out over `rise` [s]."""
    window = ease((time - start) / rise) * ease((end - time) / rise)
    return window * np.sin(2 * np.pi * cycles * (time - start) / (end - start))


def mirrored(arm: Sequence[float] | np.ndarray) -> np.ndarray:
    """The right arm's (pitch, roll, yaw, elbow) for the left arm's; works for (..., 4) too."""
    return np.asarray(arm, dtype=float) * [1, -1, -1, 1]


def pose_arm(upper: np.ndarray, side: str, arm: np.ndarray) -> None:
    """Write an arm's angles, (T, 4) in the left arm's convention, into `upper` (T, 11)."""
    upper[:, ARM_COLUMNS[side]] = arm if side == "left" else mirrored(arm)
