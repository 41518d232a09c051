"""How deep the robot's own links lie in each other, by the collision primitives of its table of facts.

A capsule is a segment with a radius, a sphere one of length 0; two of them overlap by the sum of their radii less the
distance of their segments. Bodies that are joined by one hinge or rigidly (the locked wrists) are not compared, nor
are those whose primitives overlap where all joints are at 0 (hips and pelvis): that overlap is the model's.
"""

from functools import cache

import numpy as np

from bumblebee import quaternions
from bumblebee.motion.kinematics import forward_bodies
from bumblebee.robot.facts import g1_bodies, joint_names

Poses = dict[str, tuple[np.ndarray, np.ndarray]]


def self_penetration(root_pos: np.ndarray, root_quat: np.ndarray, joint_pos: np.ndarray) -> tuple[np.ndarray, list]:
    """Depth of the deepest overlap in each frame, (T,) [m], 0 where nothing touches; and the pair of bodies, (T,).

    Args:
        root_pos: (T, 3) [m, world].
        root_quat: (T, 4) [wxyz].
        joint_pos: (T, 23) [rad].
    """
    segments = _segments(forward_bodies(root_pos, root_quat, joint_pos))
    deepest, worst = np.zeros(len(root_pos)), np.full(len(root_pos), -1)
    for number, (first, second) in enumerate(compared_bodies()):
        depth = _depth(segments[first], segments[second])
        deeper = depth > deepest
        deepest[deeper], worst[deeper] = depth[deeper], number
    return deepest, [compared_bodies()[pair] if pair >= 0 else ("", "") for pair in worst]


@cache
def compared_bodies() -> tuple[tuple[str, str], ...]:
    """The pairs of bodies whose overlap counts."""
    at_zero = _segments(forward_bodies(np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]]), np.zeros((1, len(joint_names())))))
    names = list(at_zero)
    pairs = []
    for i, first in enumerate(names):
        for second in names[i + 1 :]:
            if not _joined(first, second) and _depth(at_zero[first], at_zero[second])[0] <= 0:
                pairs.append((first, second))
    return tuple(pairs)


def _joined(first: str, second: str) -> bool:
    """Whether two bodies are one rigid piece, or a hinge apart."""
    one, other = _piece(first), _piece(second)
    return one == other or _parent_piece(one) == other or _parent_piece(other) == one


def _piece(body: str) -> str:
    """The first body of the rigid piece that a body belongs to: up the tree to the next hinge that moves."""
    facts = g1_bodies()[body]
    moves = facts.get("joint", {"name": ""})["name"] in joint_names()
    return body if moves or facts["parent"] == "world" else _piece(facts["parent"])


def _parent_piece(piece: str) -> str:
    parent = g1_bodies()[piece]["parent"]
    return "" if parent == "world" else _piece(parent)


def _segments(poses: Poses) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """For each body with primitives: ends of its segments (T, N, 3) twice [m, world], and their radii (N,) [m]."""
    found = {}
    for name, (pos, quat) in poses.items():
        if "collision" in g1_bodies()[name]:
            starts, ends, radii = _primitives(name)
            place = pos[:, None]
            turn = quat[:, None]
            found[name] = place + quaternions.rotate(turn, starts), place + quaternions.rotate(turn, ends), radii
    return found


@cache
def _primitives(body: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ends of a body's segments (1, N, 3) twice [m, body] and radii (N,) [m]."""
    starts, ends, radii = [], [], []
    for geom in g1_bodies()[body]["collision"]:
        half = geom["size"][1] if geom["type"] == "capsule" else 0.0
        reach = quaternions.rotate(geom["quat"], [0.0, 0.0, half])
        starts.append(np.asarray(geom["pos"]) - reach)
        ends.append(np.asarray(geom["pos"]) + reach)
        radii.append(geom["size"][0])
    return np.array(starts)[None], np.array(ends)[None], np.array(radii)


def _depth(first: tuple, second: tuple) -> np.ndarray:
    """Deepest overlap of the primitives of two bodies, (T,) [m]; frames in which they are far apart are skipped."""
    depth = np.full(len(first[0]), -np.inf)
    centres = [(body[0] + body[1]).mean(axis=1) / 2 for body in (first, second)]
    reach = [_reach(body, centre) for body, centre in zip((first, second), centres, strict=True)]
    near = np.flatnonzero(np.linalg.norm(centres[0] - centres[1], axis=-1) < sum(reach))
    if len(near):
        a, b, c, d = (end[near] for end in (*first[:2], *second[:2]))
        distance = segment_distance(a[:, :, None], b[:, :, None], c[:, None], d[:, None])
        overlap = first[2][:, None] + second[2][None] - distance
        depth[near] = overlap.max(axis=(1, 2))
    return depth


def _reach(body: tuple, centre: np.ndarray) -> np.ndarray:
    """Radius of a ball around `centre` (T, 3) that holds all primitives of a body, (T,) [m]."""
    ends = np.concatenate([body[0], body[1]], axis=1)
    radii = np.concatenate([body[2], body[2]])
    return (np.linalg.norm(ends - centre[:, None], axis=-1) + radii).max(axis=1)


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
