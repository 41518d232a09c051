"""Forward kinematics of the G1 over all frames of a motion at once."""

import numpy as np

from bumblebee.motion import quaternions
from bumblebee.motion.clip import Clip
from bumblebee.robot.facts import FEET, KEY_BODIES, g1_bodies, joint_names


def forward_bodies(
    root_pos: np.ndarray, root_quat: np.ndarray, joint_pos: np.ndarray
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Pose of every body of the robot: name -> ((T, 3) [m, world], (T, 4) [wxyz, body to world]).

    Args:
        root_pos: the pelvis, (T, 3) [m, world].
        root_quat: the pelvis, (T, 4) [wxyz].
        joint_pos: (T, 23) [rad] in the order of `joint_names()`; the wrists are locked at 0.
    """
    angles = {name: np.asarray(joint_pos, np.float64)[:, i] for i, name in enumerate(joint_names())}
    poses: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    for name, facts in g1_bodies().items():
        if facts["parent"] == "world":
            poses[name] = np.asarray(root_pos, np.float64), quaternions.normalised(np.asarray(root_quat, np.float64))
            continue
        parent_pos, parent_quat = poses[facts["parent"]]
        pos = parent_pos + quaternions.rotate(parent_quat, facts["pos"])
        quat = parent_quat
        if facts["quat"] != [1.0, 0.0, 0.0, 0.0]:
            quat = quaternions.multiply(quat, quaternions.normalised(facts["quat"]))
        joint = facts.get("joint")
        if joint and joint["name"] in angles:
            turn = quaternions.from_axis_angle(joint["axis"], angles[joint["name"]])
            quat = quaternions.multiply(quat, turn)
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
        if primitives := g1_bodies()[name].get("collision"):
            centres, radii = _centres(primitives)  # (N, 3), (N,): a capsule has one at either end
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
    corners = np.array([(x, y, -0.035) for x in (-0.044, 0.123) for y in (-0.021, 0.021)])
    feet = [poses[foot][0][:, None] + quaternions.rotate(poses[foot][1][:, None], corners[None]) for foot in FEET]
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


def _centres(primitives: list[dict]) -> tuple[np.ndarray, np.ndarray]:
    centres, radii = [], []
    for geom in primitives:
        reach = quaternions.rotate(geom["quat"], [0.0, 0.0, geom["size"][1]]) if geom["type"] == "capsule" else np.zeros(3)
        ends = (1.0, -1.0) if geom["type"] == "capsule" else (0.0,)
        centres += [np.asarray(geom["pos"]) + end * reach for end in ends]
        radii += [geom["size"][0]] * len(ends)
    return np.array(centres), np.array(radii)
