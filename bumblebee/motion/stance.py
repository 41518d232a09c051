"""When a motion stands and when it flies, told by rules that no retargeter or correction of ours uses.

Contact by the person's feet, where the person's motion is known; else by the height of the robot's own soles alone: a
rule that also asked for slow soles would call a foot that slides no contact. Flight by gravity: whoever is in the air
falls, so a robot that hangs over the floor without falling floats.
"""

from functools import cache

import numpy as np
from scipy import ndimage

from bumblebee import quaternions
from bumblebee.motion.clip import Clip
from bumblebee.motion.human.motion import LANDMARKS
from bumblebee.motion.kinematics import forward_bodies, lowest, sole_points
from bumblebee.robot.facts import robot_bodies

GRAVITY = 9.81
AIR = 0.01  # m: no point of the robot is nearer to the floor
FREE_FALL = -0.5 * GRAVITY  # m/s^2: the centre of mass is pulled down by at least half of gravity
SHORTEST_FALL = 0.08  # s
EDGE = 0.06  # s: a flight is wider by this at either end than what the smoothed acceleration shows
SMOOTH = 0.03  # s: standard deviation of the Gaussian before the second difference
SOLE_DOWN, SOLE_UP = 0.005, 0.01  # m over the local floor: contact begins below the first, ends above the second
FLOOR_SECONDS = 1.0  # the local floor: the highest level that the lowest point never leaves for longer than this
FOOT_DOWN, FOOT_UP = 0.04, 0.06  # m: the same of a person's foot, over the height at which it stands
FOOT_SLOW, FOOT_FAST = 0.25, 0.5  # m/s: a person's foot in contact is slower than the first, and leaves with the second
SHORTEST_CONTACT = 0.06  # s


def flights(clip: Clip) -> np.ndarray:
    """Frames in which the motion is in free flight, (T,) bool.

    The lowest point is more than 1 cm above the floor, and within 0.06 s the centre of mass falls with at least g/2
    for at least 0.08 s.
    """
    if clip.frames < 3:
        return np.zeros(clip.frames, dtype=bool)
    height = ndimage.gaussian_filter1d(centre_of_mass(clip)[:, 2], SMOOTH * clip.fps, mode="nearest")
    acceleration = np.zeros(clip.frames)
    acceleration[1:-1] = np.diff(height, 2) * clip.fps**2
    falling = long_runs(acceleration < FREE_FALL, round(SHORTEST_FALL * clip.fps))
    wide = ndimage.binary_dilation(falling, iterations=max(1, round(EDGE * clip.fps)))
    return wide & (lowest(clip.root_pos, clip.root_quat, clip.joint_pos) > AIR)


def robot_contacts(clip: Clip) -> np.ndarray:
    """Which foot is on the floor by the height of its sole alone, (T, 2) bool (left, right).

    The height is that over the motion's own floor, so that feet which slide over a floor that floats are seen, too. Of
    walks whose stance feet are known to rest (the embedded ones) the limits give at most 15 mm/s; 15 and 30 mm gave
    245, since a swinging foot passes lower than that.
    """
    low = sole_points(clip.root_pos, clip.root_quat, clip.joint_pos)[..., 2].min(axis=2)  # (T, 2)
    window = min(max(1, round(FLOOR_SECONDS * clip.fps)), clip.frames)
    floor = ndimage.grey_opening(low.min(axis=1), size=window, mode="nearest")
    over = low - floor[:, None]
    held = np.stack([hysteresis(side < SOLE_DOWN, side < SOLE_UP) for side in over.T], axis=1)
    return _kept(held, clip.fps)


def human_contacts(positions: np.ndarray, fps: float) -> np.ndarray:
    """Which of a person's feet is on the floor, (T, 2) bool (left, right), from landmarks (T, 18, 3) [m].

    A foot is on the floor where its ankle or the ball of its foot is as low as where it stands (the 5th percentile of
    its height over the motion, both sides together) and slow; hysteresis in both, for at least 0.06 s.
    """
    held = np.zeros((len(positions), 2), dtype=bool)
    for part in ("ankle", "toe"):
        points = np.stack([positions[:, LANDMARKS.index(f"{side}_{part}")] for side in ("left", "right")], axis=1)
        over = points[..., 2] - np.percentile(points[..., 2], 5)
        speed = np.linalg.norm(np.gradient(points, axis=0), axis=-1) * fps if len(points) > 1 else np.zeros(over.shape)
        sure, possible = (over < FOOT_DOWN) & (speed < FOOT_SLOW), (over < FOOT_UP) & (speed < FOOT_FAST)
        held |= np.stack([hysteresis(sure[:, side], possible[:, side]) for side in (0, 1)], axis=1)
    return _kept(held, fps)


def centre_of_mass(clip: Clip) -> np.ndarray:
    """(T, 3) [m, world], from the masses of the bodies."""
    poses = forward_bodies(clip.root_pos, clip.root_quat, clip.joint_pos)
    masses, places = _masses()
    total = np.zeros((clip.frames, 3))
    for name, (pos, quat) in poses.items():
        total += masses[name] * (pos + quaternions.rotate(quat, places[name]))
    return total / sum(masses.values())


def hysteresis(sure: np.ndarray, possible: np.ndarray) -> np.ndarray:
    """The runs of `possible` (T,) in which some frame is `sure` (T,)."""
    labels, count = ndimage.label(possible)
    wanted = np.unique(labels[sure & possible])
    return np.isin(labels, wanted[wanted > 0]) if count else np.zeros(len(sure), dtype=bool)


def long_runs(flags: np.ndarray, least: int) -> np.ndarray:
    """The runs of True (T,) that are at least so many frames long."""
    labels, count = ndimage.label(flags)
    sizes = np.bincount(labels, minlength=count + 1)
    sizes[0] = 0
    return sizes[labels] >= max(least, 1)


def _kept(held: np.ndarray, fps: float) -> np.ndarray:
    return np.stack([long_runs(side, round(SHORTEST_CONTACT * fps)) for side in held.T], axis=1)


@cache
def _masses() -> tuple[dict[str, float], dict[str, np.ndarray]]:
    """Mass [kg] and centre of mass (3,) [m, body] of each body."""
    bodies = robot_bodies()
    return {n: f["mass"] for n, f in bodies.items()}, {n: np.asarray(f["com"]) for n, f in bodies.items()}
