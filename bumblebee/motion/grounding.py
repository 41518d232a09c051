"""Floor correction: brings a motion that floats or sinks slowly back to the floor, and levels its soles there.

Motions estimated from video float by up to 14 cm, by an amount that changes over seconds, with toes pointing down.
Shifting a whole clip by its lowest point leaves the rest of it in the air. Here the floor is estimated as the lower
envelope of the robot's lowest point over about a second, which follows the drift and passes under a jump.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from scipy import ndimage

from bumblebee import quaternions
from bumblebee.motion.kinematics import forward_bodies, lowest, sole_points
from bumblebee.ranges import Range, Ranged
from bumblebee.robot.facts import BODY_OF, FEET, ankles, columns, joints
from bumblebee.robot.written import SIDES

Method = Literal["refit", "lower", "off"]


@dataclass(frozen=True)
class GroundingConfig(Ranged):
    """How a motion's height is corrected."""

    method: Method = "refit"
    """`refit`: fit the whole trajectory again with the solver that retargets people; `lower`: take the floor out of the
    heights and level the ankles; `off`: leave what floats. Motions that were made on the floor (the embedded ones) are
    never changed."""
    tolerance: Annotated[float, Range(least=0, most=10)] = 0.025
    """A motion whose estimated floor stays within this distance of 0 is left as it is [m]."""
    jump_seconds: Annotated[float, Range(least=0, most=60)] = 1.0
    """A rise shorter than this is a jump and stays; a longer one is an error of the estimate [s]."""
    smooth_seconds: Annotated[float, Range(least=0, most=60)] = 0.15
    """Standard deviation of the Gaussian that smooths the correction over time [s]."""
    level_ankles: bool = True
    """Turn the ankles so that a foot which is near the floor and slow stands flat."""
    level_below: Annotated[float, Range(above=0, most=1)] = 0.08
    """A sole at this height above the estimated floor, or higher, keeps its ankle angles [m]."""


def ground(
    root_pos: np.ndarray, root_quat: np.ndarray, joint_pos: np.ndarray, fps: float, config: GroundingConfig
) -> tuple[np.ndarray, np.ndarray]:
    """Corrected copies of `root_pos` (T, 3) [m] and `joint_pos` (T, 23) [rad]; only heights and ankles change."""
    floor = floor_height(lowest(root_pos, root_quat, joint_pos), fps, config)
    if config.method == "off" or np.abs(floor).max() <= config.tolerance:
        return root_pos, joint_pos
    lowered = root_pos - floor[:, None] * np.array([0.0, 0.0, 1.0])
    if config.level_ankles:
        joint_pos = level_ankles(lowered, root_quat, joint_pos, fps, config)
        floor = floor_height(lowest(lowered, root_quat, joint_pos), fps, config)
        lowered = lowered - floor[:, None] * np.array([0.0, 0.0, 1.0])
    return lowered, joint_pos


def floor_height(low: np.ndarray, fps: float, config: GroundingConfig) -> np.ndarray:
    """The floor under a motion whose lowest point is `low` (T,) [m]: its smoothed morphological opening."""
    blink = max(1, round(0.1 * fps))
    steady = ndimage.grey_closing(low, size=blink, mode="nearest")  # a dip of a few frames is no floor
    window = min(max(1, round(config.jump_seconds * fps)), len(low))
    opened = ndimage.grey_opening(steady, size=window, mode="nearest")
    return ndimage.gaussian_filter1d(opened, max(config.smooth_seconds * fps, 1e-3), mode="nearest")


def level_ankles(
    root_pos: np.ndarray, root_quat: np.ndarray, joint_pos: np.ndarray, fps: float, config: GroundingConfig
) -> np.ndarray:
    """Joint angles (T, 23) with the ankles turned towards level soles, the more so the nearer and slower the foot."""
    poses = forward_bodies(root_pos, root_quat, joint_pos)
    heights = sole_points(root_pos, root_quat, joint_pos)[..., 2].min(axis=2)  # (T, 2)
    levelled = np.array(joint_pos, dtype=np.float64)
    for side, foot in enumerate(FEET):
        turns = {int(np.argmax(np.abs(joints()[column].axis))): column for column in columns(ankles(SIDES[side]))}
        shin = poses[BODY_OF[f"{SIDES[side]}_knee"]][1]
        up = quaternions.rotate(quaternions.conjugate(shin), [0.0, 0.0, 1.0])
        level = np.stack([np.arctan2(up[:, 0], up[:, 2]), -np.arcsin(np.clip(up[:, 1], -1, 1))], axis=1)
        own = [(turns[axis], angle) for axis, angle in ((1, 0), (0, 1)) if axis in turns]  # pitch about y, roll about x
        ankle, level = [column for column, _ in own], level[:, [angle for _, angle in own]]
        limits = np.array([joints()[column].range for column in ankle])
        level = np.clip(level, limits[:, 0], limits[:, 1])
        speed = np.linalg.norm(np.gradient(poses[foot][0], axis=0), axis=1) * fps
        weight = _falling(heights[:, side], config.level_below) * _falling(speed, 1.0)
        weight = ndimage.gaussian_filter1d(weight, 0.06 * fps, mode="nearest")[:, None]
        levelled[:, ankle] = (1 - weight) * levelled[:, ankle] + weight * level
    return levelled


def _falling(value: np.ndarray, end: float) -> np.ndarray:
    """1 up to a quarter of `end`, 0 from `end` on, a smooth step between."""
    share = np.clip((end - value) / (0.75 * end), 0, 1)
    return share * share * (3 - 2 * share)
