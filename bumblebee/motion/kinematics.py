"""Forward kinematics of the G1 over all frames of a motion at once."""

from functools import cache

import numpy as np

from bumblebee import quaternions
from bumblebee.motion.clip import Clip
from bumblebee.robot.facts import FEET, KEY_BODIES, SOLE_RADIUS, SOLES, joint_names, robot_bodies

_DOWN = (0.0, 0.0, SOLE_RADIUS)  # m from a corner's sphere to the floor


def forward_bodies(
    root_pos: np.ndarray, root_quat: np.ndarray, joint_pos: np.ndarray
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Pose of every body of the robot: name -> ((T, 3) [m, world], (T, 4) [wxyz, body to world]).

    Args:
        root_pos: the pelvis, (T, 3) [m, world].
        root_quat: the pelvis, (T, 4) [wxyz].
        joint_pos: (T, 23) [rad] in the order of `joint_names()`; the wrists are locked at 0.
    """
    joint_pos = np.asarray(joint_pos, np.float64)
    root = np.asarray(root_pos, np.float64), quaternions.normalised(np.asarray(root_quat, np.float64))
    poses: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    for name, parent, offset, fixed, axis, column in _tree():
        if parent not in poses:
            poses[name] = root
            continue
        pos, quat = poses[parent]
        pos = pos + quaternions.rotate(quat, offset)
        if fixed is not None:
            quat = quaternions.multiply(quat, fixed)
        if column is not None:
            quat = quaternions.multiply(quat, quaternions.from_axis_angle(axis, joint_pos[:, column]))
        poses[name] = pos, quat
    return poses


def forward_key_positions(root_pos: np.ndarray, root_quat: np.ndarray, joint_pos: np.ndarray) -> np.ndarray:
    """Positions of `KEY_BODIES`, (T, 14, 3) [m, world], from (T, 3) [m], (T, 4) [wxyz] and (T, 23) [rad]."""
    poses = forward_bodies(root_pos, root_quat, joint_pos)
    return np.stack([poses[body][0] for body in KEY_BODIES], axis=1)


def lowest_heights(root_pos: np.ndarray, root_quat: np.ndarray, joint_pos: np.ndarray) -> dict[str, np.ndarray]:
    """Height of the lowest point of each body that has collision primitives: name -> (T,) [m, world]."""
    heights = {}
    for name, (pos, quat) in forward_bodies(root_pos, root_quat, joint_pos).items():
        if "collision" in robot_bodies()[name]:
            centres, radii = _centres(name)  # (N, 3), (N,): a capsule has one at either end
            w, x, y, z = quat.T
            up = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)
            heights[name] = pos[:, 2] + (up @ centres.T - radii).min(axis=1)
    return heights


def lowest(root_pos: np.ndarray, root_quat: np.ndarray, joint_pos: np.ndarray) -> np.ndarray:
    """Height of the robot's lowest point in each frame, (T,) [m, world]."""
    return np.min(list(lowest_heights(root_pos, root_quat, joint_pos).values()), axis=0)


def sole_points(root_pos: np.ndarray, root_quat: np.ndarray, joint_pos: np.ndarray) -> np.ndarray:
    """Heel and toe corners of both soles, (T, 2, 4, 3) [m, world], left foot first."""
    poses = forward_bodies(root_pos, root_quat, joint_pos)
    feet = [
        poses[foot][0][:, None] + quaternions.rotate(poses[foot][1][:, None], (np.array(soles) - _DOWN)[None])
        for foot, soles in zip(FEET, SOLES, strict=True)
    ]
    return np.stack(feet, axis=1)


def make_clip(
    name: str,
    fps: float,
    root_pos: np.ndarray,
    root_quat: np.ndarray,
    joint_pos: np.ndarray,
    **about: object,
) -> Clip:
    """A clip with its keypoints; `about` are the remaining fields of `Clip` (captions, source, licence ...)."""
    root_quat = quaternions.continuous(quaternions.normalised(np.asarray(root_quat, np.float64)))
    key_pos = forward_key_positions(root_pos, root_quat, joint_pos)
    arrays = [np.ascontiguousarray(a, dtype=np.float32) for a in (root_pos, root_quat, joint_pos, key_pos)]
    return Clip(name, float(fps), *arrays, **about)  # type: ignore[arg-type]


@cache
def _tree() -> list[tuple[str, str, np.ndarray, np.ndarray | None, np.ndarray, int | None]]:
    """For each body: name, parent, offset (3,) [m], fixed rotation (4,) or None, joint axis (3,), its column."""
    rows = []
    for name, facts in robot_bodies().items():
        fixed = None if facts["quat"] == [1.0, 0.0, 0.0, 0.0] else quaternions.normalised(facts["quat"])
        joint = facts.get("joint", {"name": "", "axis": (0.0, 0.0, 0.0)})
        column = joint_names().index(joint["name"]) if joint["name"] in joint_names() else None
        rows.append((name, facts["parent"], np.array(facts["pos"]), fixed, np.array(joint["axis"]), column))
    return rows


@cache
def _centres(body: str) -> tuple[np.ndarray, np.ndarray]:
    """Centres (N, 3) [m, body] and radii (N,) [m] of a body's spheres and of the ends of its capsules."""
    centres, radii = [], []
    for geom in robot_bodies()[body]["collision"]:
        capsule = geom["type"] == "capsule"
        reach = quaternions.rotate(geom["quat"], [0.0, 0.0, geom["size"][1]]) if capsule else np.zeros(3)
        ends = (1.0, -1.0) if capsule else (0.0,)
        centres += [np.asarray(geom["pos"]) + end * reach for end in ends]
        radii += [geom["size"][0]] * len(ends)
    return np.array(centres), np.array(radii)
