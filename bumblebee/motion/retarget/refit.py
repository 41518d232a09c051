"""A robot's motion that floats, fitted again over the whole trajectory with the solver that retargets people.

What the robot should do comes from its own forward kinematics with the slowly varying floor taken out: its limbs,
hips and feet, and its soles on the floor where they are low and slow. Its joints stay near the angles that came.
"""

from dataclasses import replace

import numpy as np
from scipy.signal import butter, sosfiltfilt

from bumblebee import quaternions
from bumblebee.motion.grounding import GroundingConfig, floor_height
from bumblebee.motion.human.motion import LANDMARKS
from bumblebee.motion.kinematics import lowest
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.retarget.config import RetargetConfig
from bumblebee.motion.retarget.contacts import stance
from bumblebee.motion.retarget.mapping import CORNERS, POINTS, SIDES, Robot, this_robot
from bumblebee.motion.retarget.retarget import fit, root_quat
from bumblebee.motion.retarget.targets import SEGMENTS, Targets
from bumblebee.motion.retarget.tree import points, poses

VERSION = 1
"""Version of the method: a cached result of another version is made again."""
LEAST = 5  # frames: an acceleration needs three
_NEAR = (0.10, 0.15)  # m over the robot's lowest point: a foot below stands, one above does not, whatever its speed
_EDGE = 30  # frames by which the low-pass extends a motion at its ends


def refit(raw: RawMotion, grounding: GroundingConfig, config: RetargetConfig) -> RawMotion:
    """A motion of the G1 that stands on the floor, with a note of what changed; as it came where it stood already.

    Args:
        raw: at an even rate, its joints in the G1's order.
        grounding: `tolerance` and how the floor is estimated.
        config: the solver's settings; `refit_posture` says how near the joints stay.
    """
    floor = floor_height(lowest(raw.root_pos, raw.root_quat, raw.joint_pos), raw.fps, grounding)
    if np.abs(floor).max() <= grounding.tolerance or len(raw.root_pos) < LEAST:
        return raw
    at = fit(
        own_targets(raw, floor, this_robot(), grounding, config),
        this_robot(),
        replace(config, posture=config.refit_posture),
    )
    change = np.abs(at.joint - raw.joint_pos)
    note = f"the floor was taken out by up to {np.abs(floor).max():.2f} m"
    note += f"; joint angles changed by {change.mean():.3f} rad on average, {change.max():.2f} at most"
    return replace(raw, root_pos=at.root, root_quat=root_quat(at), joint_pos=at.joint, notes=(*raw.notes, note))


def own_targets(
    raw: RawMotion, floor: np.ndarray, robot: Robot, grounding: GroundingConfig, config: RetargetConfig
) -> Targets:
    """Targets of what the robot did, low-passed, over a `floor` (T,) [m] that is taken out."""
    joint = low_passed(raw.joint_pos, raw.fps, config.cutoff)
    root = low_passed(raw.root_pos, raw.fps, config.cutoff) - floor[:, None] * np.array([0.0, 0.0, 1.0])
    quat = low_passed(quaternions.continuous(raw.root_quat), raw.fps, config.cutoff)
    turn = quaternions.to_matrices(quaternions.normalised(quat))
    at = poses(robot.tree, root, turn, joint)
    where = dict(zip(POINTS, np.moveaxis(points(at, robot.body, robot.local), 1, 0), strict=True))
    hips = (where["left_hip"] + where["right_hip"]) / 2
    segments = np.stack([where[b] - where[a] for a, b in SEGMENTS] + [where["neck"] - hips], axis=1)
    soles = points(at, robot.sole_body, robot.sole).reshape(len(root), 2, 2, CORNERS // 2, 3)  # side, heel and toe
    stands = _contacts(soles, robot.radius, raw.fps, grounding, config)
    middles = soles.mean(axis=3)
    feet = middles[:, :, 1] - middles[:, :, 0]
    feet[..., 2] *= 1 - stands.max(axis=2)  # a foot that stands is level
    contact = np.repeat(stands, CORNERS // 2, axis=2).reshape(len(root), -1)
    return Targets(raw.fps, segments, hips, feet, contact, turn, floor, joint)


def low_passed(values: np.ndarray, fps: float, cutoff: float) -> np.ndarray:
    """Values (T, n) at `fps` without what is faster than `cutoff` [Hz], zero-phase; short motions as they are."""
    if fps <= 2.2 * cutoff or len(values) <= _EDGE:
        return np.array(values, np.float64)
    return sosfiltfilt(butter(2, cutoff, fs=fps, output="sos"), values, axis=0, padlen=_EDGE)


def _contacts(
    soles: np.ndarray, radius: float, fps: float, grounding: GroundingConfig, config: RetargetConfig
) -> np.ndarray:
    """How much heel and ball of both feet stand, (T, 2, 2) from 0 to 1, from the soles' corners (T, 2, 2, 2, 3) [m]."""
    feet = soles.mean(axis=3)
    feet[..., 2] = soles[..., 2].min(axis=3) - radius
    marks = np.zeros((len(soles), len(LANDMARKS), 3))
    for i, side in enumerate(SIDES):
        marks[:, LANDMARKS.index(f"{side}_ankle")] = feet[:, i, 0]
        marks[:, LANDMARKS.index(f"{side}_toe")] = feet[:, i, 1]
    low = feet[..., 2].min(axis=2, keepdims=True)
    near = np.clip((_NEAR[1] - low) / (_NEAR[1] - _NEAR[0]), 0, 1)  # someone who lies has feet in the air for seconds
    return stance(marks, fps, config.contact, grounding).contact * near
