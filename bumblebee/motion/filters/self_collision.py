"""How deep the robot's own links lie in each other, by the collision primitives of its table of facts.

A capsule is a segment with a radius, a sphere one of length 0; two of them overlap by the sum of their radii less the
distance of their segments. Bodies that are joined by one hinge or rigidly (the locked wrists) are not compared, nor
are those whose primitives overlap where all joints are at 0 (hips and pelvis): that overlap is the model's.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from bumblebee import quaternions
from bumblebee.motion.kinematics import forward_bodies
from bumblebee.robot.facts import joint_names, robot_bodies

Poses = dict[str, tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Links:
    """The primitives of one body over a motion: segments with radii, and a ball that holds them all."""

    starts: np.ndarray
    """(T, N, 3) [m, world]."""
    ends: np.ndarray
    """(T, N, 3) [m, world]."""
    radii: np.ndarray
    """(N,) [m]."""
    centre: np.ndarray
    """(T, 3) [m, world], of the ball."""
    reach: float
    """Its radius [m]."""


def self_penetration(
    root_pos: np.ndarray, root_quat: np.ndarray, joint_pos: np.ndarray
) -> tuple[np.ndarray, list[tuple[str, str]]]:
    """Depth of the deepest overlap in each frame, (T,) [m], 0 where nothing touches; and the pair of bodies, T of them.

    Args:
        root_pos: (T, 3) [m, world].
        root_quat: (T, 4) [wxyz].
        joint_pos: (T, 23) [rad].
    """
    links = _links(forward_bodies(root_pos, root_quat, joint_pos))
    deepest, worst = np.zeros(len(root_pos)), np.full(len(root_pos), -1)
    for number, (first, second) in enumerate(compared_bodies()):
        one, other = links[first], links[second]
        near = np.flatnonzero(_squared(one.centre - other.centre) < (one.reach + other.reach) ** 2)
        if len(near):
            depth = _depth(one, other, near)
            deeper = depth > deepest[near]
            deepest[near[deeper]], worst[near[deeper]] = depth[deeper], number
    return deepest, [compared_bodies()[pair] if pair >= 0 else ("", "") for pair in worst]


@cache
def compared_bodies() -> tuple[tuple[str, str], ...]:
    """The pairs of bodies whose overlap counts."""
    at_zero = _links(forward_bodies(np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]]), np.zeros((1, len(joint_names())))))
    names, only = list(at_zero), np.zeros(1, dtype=int)
    pairs = []
    for i, first in enumerate(names):
        for second in names[i + 1 :]:
            if not _joined(first, second) and _depth(at_zero[first], at_zero[second], only)[0] <= 0:
                pairs.append((first, second))
    return tuple(pairs)


def _joined(first: str, second: str) -> bool:
    """Whether two bodies are one rigid piece, or a hinge apart."""
    one, other = _piece(first), _piece(second)
    return one == other or _parent_piece(one) == other or _parent_piece(other) == one


def _piece(body: str) -> str:
    """The first body of the rigid piece that a body belongs to: up the tree to the next hinge that moves."""
    facts = robot_bodies()[body]
    moves = facts.get("joint", {"name": ""})["name"] in joint_names()
    return body if moves or facts["parent"] == "world" else _piece(facts["parent"])


def _parent_piece(piece: str) -> str:
    parent = robot_bodies()[piece]["parent"]
    return "" if parent == "world" else _piece(parent)


def _links(poses: Poses) -> dict[str, Links]:
    """The bodies that have primitives."""
    found = {}
    for name, (pos, quat) in poses.items():
        if "collision" in robot_bodies()[name]:
            starts, ends, radii, centre, reach = _primitives(name)
            corners = np.concatenate([starts, ends, centre[None]])
            placed = pos[:, None] + quaternions.rotate(quat[:, None], corners[None])
            found[name] = Links(placed[:, : len(radii)], placed[:, len(radii) : -1], radii, placed[:, -1], reach)
    return found


@cache
def _primitives(body: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """Ends of a body's segments (N, 3) twice [m, body], radii (N,) [m]; middle (3,) and radius of a ball around all."""
    starts, ends, radii = [], [], []
    for geom in robot_bodies()[body]["collision"]:
        half = geom["size"][1] if geom["type"] == "capsule" else 0.0
        reach = quaternions.rotate(geom["quat"], [0.0, 0.0, half])
        starts.append(np.asarray(geom["pos"]) - reach)
        ends.append(np.asarray(geom["pos"]) + reach)
        radii.append(geom["size"][0])
    centre = np.mean(starts + ends, axis=0)
    ball = (np.linalg.norm(np.array(starts + ends) - centre, axis=-1) + np.array(radii + radii)).max()
    return np.array(starts), np.array(ends), np.array(radii), centre, float(ball)


def _depth(one: Links, other: Links, frames: np.ndarray) -> np.ndarray:
    """Deepest overlap of the primitives of two bodies in these frames (n,), (n,) [m]; negative where they are apart."""
    a, b = one.starts[frames, :, None], one.ends[frames, :, None]
    c, d = other.starts[frames, None], other.ends[frames, None]
    overlap = one.radii[:, None] + other.radii[None] - segment_distance(a, b, c, d)
    return overlap.max(axis=(1, 2))


def _squared(vector: np.ndarray) -> np.ndarray:
    return np.einsum("ti,ti->t", vector, vector)


def segment_distance(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Distance of the segments from a to b and from c to d, each (..., 3) [m] -> (...) [m]; a segment may be a point.

    The closest points of the two lines, clipped to the first segment, then each in turn to the other's nearest point:
    exact, since the squared distance is convex in the two parameters (Ericson, "Real-Time Collision Detection", 5.1.9).
    """
    u, v, w = b - a, d - c, a - c
    uu, vv, uv = (u * u).sum(-1), (v * v).sum(-1), (u * v).sum(-1)
    uw, vw = (u * w).sum(-1), (v * w).sum(-1)
    det = uu * vv - uv * uv
    s = np.clip(np.where(det > 1e-12, (uv * vw - vv * uw) / np.maximum(det, 1e-12), 0.0), 0.0, 1.0)
    t = np.clip((uv * s + vw) / np.maximum(vv, 1e-12), 0.0, 1.0)
    s = np.clip((uv * t - uw) / np.maximum(uu, 1e-12), 0.0, 1.0)
    return np.linalg.norm(w + s[..., None] * u - t[..., None] * v, axis=-1)
