"""How good a motion on the robot is: floor, feet, limits, smoothness, self-collision; and how far two motions differ.

Every measure is one number with its unit in its name. Nothing here is used to make a motion, so that a retargeter or a
correction can be judged by it.
"""

import numpy as np

from bumblebee.motion.clip import Clip
from bumblebee.motion.filters.self_collision import self_penetration
from bumblebee.motion.kinematics import lowest, sole_points
from bumblebee.motion.stance import flights, human_contacts, robot_contacts
from bumblebee.robot.facts import joints

TOUCHES = 0.005  # m: an overlap of the links that is deeper counts as a self-collision
TOLERANCE = 1e-4  # rad: what rounding and resampling may add to a joint that stands at its limit
FIRST = 5  # steps between frames that are the beginning of a motion


def quality(clip: Clip, human: np.ndarray | None = None) -> dict[str, float]:
    """All measures of a motion; NaN where there is nothing to measure (no contact, too few frames).

    Args:
        clip: on the G1.
        human: the landmarks (T, 18, 3) [m, world, z up] of the person's motion at the clip's frames, from which
            contact is then told; without, by the robot's own soles and by free fall (`stance.py`).
    """
    if human is not None and len(human) != clip.frames:
        raise ValueError(f"{clip.name}: {len(human)} frames of the person, {clip.frames} of the robot")
    contacts = robot_contacts(clip) if human is None else human_contacts(human, clip.fps)
    standing = np.asarray(~flights(clip) if human is None else contacts.any(axis=1))
    return {**floor(clip, standing), **skate(clip, contacts), **limits(clip), **smoothness(clip), **collisions(clip)}


def floor(clip: Clip, standing: np.ndarray) -> dict[str, float]:
    """Penetration and floating of the lowest point [mm].

    `penetration_p1`: the depth of the 1st percentile of heights; `penetration`: the deepest. `floating_p99`,
    `floating`: the 99th percentile and the largest of the heights in the frames `standing` (T,) bool.
    """
    low = 1000 * lowest(clip.root_pos, clip.root_quat, clip.joint_pos)
    above = np.maximum(low[standing], 0.0)
    return {
        "penetration_p1_mm": max(0.0, -float(np.percentile(low, 1))),
        "penetration_mm": max(0.0, -float(low.min())),
        "floating_p99_mm": float(np.percentile(above, 99)) if len(above) else float("nan"),
        "floating_mm": float(above.max()) if len(above) else float("nan"),
    }


def skate(clip: Clip, contacts: np.ndarray) -> dict[str, float]:
    """Horizontal speed of the soles in contact [mm/s], mean and 99th percentile; share of frames with a contact.

    Of each foot that is in contact (T, 2) bool in two frames in a row, the sole's corner that is lowest over both: a
    foot that rolls or turns on an edge does not skate.
    """
    speed = sole_speed(clip)
    both = contacts[1:] & contacts[:-1]
    values = 1000 * speed[both]
    nothing = not len(values)
    return {
        "skate_mm_s": float("nan") if nothing else float(values.mean()),
        "skate_p99_mm_s": float("nan") if nothing else float(np.percentile(values, 99)),
        "contact_share": float(contacts.any(axis=1).mean()),
    }


def sole_speed(clip: Clip) -> np.ndarray:
    """Horizontal speed of each sole's lowest corner from a frame to the next, (T - 1, 2) [m/s], left foot first."""
    points = sole_points(clip.root_pos, clip.root_quat, clip.joint_pos)  # (T, 2, 4, 3)
    speed = np.linalg.norm(np.diff(points[..., :2], axis=0), axis=-1) * clip.fps  # (T - 1, 2, 4)
    corner = (points[1:, ..., 2] + points[:-1, ..., 2]).argmin(axis=2)
    return np.take_along_axis(speed, corner[..., None], axis=2)[..., 0]


def limits(clip: Clip) -> dict[str, float]:
    """Frames beyond a joint's range and the worst excess [rad]; joint steps above the motor's speed, and the worst.

    `limit_frames` is a share of the frames, `velocity_share` one of all joints in all steps between frames.
    """
    ranges = np.array([joint.range for joint in joints()])
    fastest = np.array([joint.velocity_limit for joint in joints()])
    excess = np.maximum(ranges[:, 0] - clip.joint_pos, clip.joint_pos - ranges[:, 1])
    beyond = excess > TOLERANCE
    over = np.abs(_steps(clip.joint_pos, clip.fps)) - fastest
    some = over.size > 0
    return {
        "limit_frames": float(beyond.any(axis=1).mean()),
        "limit_excess_rad": float(np.where(beyond, excess, 0.0).max()),
        "velocity_share": float((over > 0).mean()) if some else 0.0,
        "velocity_excess_rad_s": max(0.0, float(over.max())) if some else 0.0,
    }


def smoothness(clip: Clip) -> dict[str, float]:
    """Mean absolute third difference of joints and keypoints; the beginning; the fastest pelvis.

    `first_step` is the largest joint step of the first five over the 99th percentile of the largest joint steps of the
    others: above 1, the beginning is worse than the rest.
    """
    cube = clip.fps**3
    jerk = np.abs(np.diff(clip.joint_pos.astype(np.float64), 3, axis=0)) * cube
    key = np.linalg.norm(np.diff(clip.key_pos.astype(np.float64), 3, axis=0), axis=-1) * cube
    steps = np.abs(_steps(clip.joint_pos, clip.fps)).max(axis=1) if clip.frames > 1 else np.zeros(0)
    root = np.linalg.norm(_steps(clip.root_pos, clip.fps), axis=-1)
    enough = len(steps) > FIRST
    usual = float(np.percentile(steps[FIRST:], 99)) if enough else 0.0
    return {
        "jerk_rad_s3": float(jerk.mean()) if jerk.size else float("nan"),
        "key_jerk_m_s3": float(key.mean()) if key.size else float("nan"),
        "first_step": float(steps[:FIRST].max()) / max(usual, 1e-6) if enough else float("nan"),
        "root_speed_m_s": float(root.max()) if root.size else 0.0,
    }


def collisions(clip: Clip) -> dict[str, float]:
    """Deepest overlap of the robot's own links [mm], and the share of frames in which it is deeper than 5 mm."""
    depth, _ = self_penetration(clip.root_pos, clip.root_quat, clip.joint_pos)
    return {"self_penetration_mm": 1000 * float(depth.max()), "self_collision_frames": float((depth > TOUCHES).mean())}


def joint_error(first: Clip, second: Clip) -> float:
    """Mean absolute difference of the joint angles [rad] at the times that both have, from their first frames on."""
    one, other = _together(first.joint_pos, first.fps, second.joint_pos, second.fps)
    return float(np.abs(one - other).mean())


def keypoint_error(first: Clip, second: Clip) -> dict[str, float]:
    """Mean distance of the keypoints [mm]: in the world, and each relative to its own pelvis (world axes)."""
    one, other = _together(first.key_pos, first.fps, second.key_pos, second.fps)
    there = np.linalg.norm(one - other, axis=-1)
    relative = np.linalg.norm((one - one[:, :1]) - (other - other[:, :1]), axis=-1)[:, 1:]  # the pelvis is the origin
    return {"global_mm": 1000 * float(there.mean()), "root_relative_mm": 1000 * float(relative.mean())}


def at_times(values: np.ndarray, fps: float, times: np.ndarray) -> np.ndarray:
    """Values (T, ...) at `fps`, linear between their frames, at other `times` (n,) [s]."""
    at = np.clip(times * fps, 0, len(values) - 1)
    before = np.minimum(at.astype(int), max(len(values) - 2, 0))
    share = (at - before).reshape(-1, *[1] * (values.ndim - 1))
    after = np.minimum(before + 1, len(values) - 1)
    return (1 - share) * values[before].astype(np.float64) + share * values[after]


def _together(first: np.ndarray, fps: float, second: np.ndarray, other_fps: float) -> tuple[np.ndarray, np.ndarray]:
    """Both at the frames of the first that lie within both."""
    end = min((len(first) - 1) / fps, (len(second) - 1) / other_fps)
    times = np.arange(int(np.floor(end * fps + 1e-6)) + 1) / fps
    return at_times(first, fps, times), at_times(second, other_fps, times)


def _steps(values: np.ndarray, fps: float) -> np.ndarray:
    return np.diff(values.astype(np.float64), axis=0) * fps
