"""The first frames and the floor of a person's motion: frames of something else in front, a floor that is not at 0."""

import numpy as np

from bumblebee.motion.human.motion import LANDMARKS

_REST = {"ankle": 0.07, "toe": 0.015}
"""Heights of the joints over the floor while the foot stands flat [m]: of SMPL's mean body, from the sole boxes of the
MJCF that `smpl_body.py` names; ankles at 4 % of a person's height."""
_STILL = 0.3  # speed below which a foot stands [m/s]
_STANDING = 0.05  # share of the frames in which some foot must stand for a floor to be found
_LOW = 10.0  # percentile of the standing feet's heights that is the floor: most stand on it, none much below it
_OFF = 0.01  # a floor this near to 0 is at 0 [m]
_LEAD = 12  # frames at the start among which bad ones and the passage from them to the motion are looked for
_USUAL = 60  # frames after these with which they are compared
_TIMES = 2.5  # a step this many times their median is none of the motion's
_SLOW = 1.0  # mean speed of the landmarks below which a step always is the motion's [m/s]
_JERKED = 2.0  # change of the landmarks' velocity from a step to the next that no person makes, at least, mean [m/s]

_INDEX = {name: i for i, name in enumerate(LANDMARKS)}


def bad_start(positions: np.ndarray, fps: float) -> int:
    """Number of frames at the start that do not belong to the motion: a T-pose, a teleported or turned frame.

    A step out of them is faster than the steps that follow and ends at once: from one frame to the next the landmarks
    change their velocity by 2 m/s in the mean, and by more than anywhere in what follows. Some files hold a few frames
    behind it that were never set, or the ringing of a filter: the cut goes up to the last step that is too fast.
    """
    if len(positions) < _LEAD + 3:
        return 0
    step = np.diff(positions[: _LEAD + _USUAL + 1], axis=0) * fps
    speed = np.linalg.norm(step, axis=2).mean(axis=1)
    change = np.linalg.norm(np.diff(step, axis=0), axis=2).mean(axis=1)
    fast = speed[:_LEAD] > max(_TIMES * float(np.median(speed[_LEAD:])), _SLOW)
    if not (fast & (change[:_LEAD] > max(change[_LEAD:].max(), _JERKED))).any():
        return 0
    return int(np.flatnonzero(fast)[-1]) + 1


def floor_height(positions: np.ndarray, fps: float) -> float | None:
    """Height of the floor on which the person stands [m]; None where no foot stands still for long enough.

    A joint of a foot that moves slower than 0.3 m/s stands, its height less what it has on a flat foot is a height of
    the floor; the lowest joint of each frame counts, the 10th percentile of these is the floor. What stands higher
    (steps, a raised knee held still) does not move it, nor does a jump.
    """
    joints = [f"{side}_{joint}" for side in ("left", "right") for joint in _REST]
    soles = positions[:, [_INDEX[joint] for joint in joints]]
    speed = np.linalg.norm(np.gradient(soles, axis=0), axis=2) * fps if len(soles) > 1 else np.zeros(soles.shape[:2])
    height = soles[:, :, 2] - [_REST[joint.split("_")[1]] for joint in joints]
    lowest = height.argmin(axis=1)[:, None]
    still = np.take_along_axis(speed, lowest, axis=1)[:, 0] < _STILL
    if still.mean() < _STANDING:
        return None
    return float(np.percentile(np.take_along_axis(height, lowest, axis=1)[still, 0], _LOW))


def on_floor(positions: np.ndarray, fps: float) -> tuple[np.ndarray, tuple[str, ...]]:
    """The motion with its floor at 0, by one shift for all frames, and a note; nothing that drifts is corrected."""
    floor = floor_height(positions, fps)
    if floor is None:
        return positions, ("no foot stands: the floor was left where the file has it",)
    if abs(floor) <= _OFF:
        return positions, ()
    return positions - [0.0, 0.0, floor], (f"the floor was at {floor:+.3f} m, moved to 0",)
