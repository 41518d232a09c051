"""Links that must not meet each other or go below the floor: the robot's spheres and capsules."""

from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee import quaternions
from bumblebee.motion.retarget.banded import Normal
from bumblebee.motion.retarget.mapping import CORNERS, Robot
from bumblebee.motion.retarget.tree import Poses, poses

_NEIGHBOURS = 2  # links so few joints apart overlap by design


@dataclass(frozen=True, eq=False)
class Shapes:
    """Capsules (G): `body` (G,), `ends` (G, 2, 3) [m] in its frame, `radius` (G,) [m]; a sphere has equal ends."""

    body: np.ndarray
    ends: np.ndarray
    radius: np.ndarray
    foot: np.ndarray
    """Whether it is a foot, whose sole has terms of its own for the floor (G,)."""


@dataclass(frozen=True, eq=False)
class Obstacles:
    """Shapes to be kept apart: `shapes` and the pairs of them (P, 2) that may meet."""

    shapes: Shapes
    pairs: np.ndarray


def obstacles(robot: Robot) -> Obstacles:
    """Shapes of a robot, and pairs that are neither neighbours nor overlap while the robot rests."""
    shapes = _shapes(robot)
    first, second = np.triu_indices(len(shapes.body), 1)
    apart = _hops(robot.tree.parent)[shapes.body[first], shapes.body[second]] > _NEIGHBOURS
    pairs = np.stack([first, second], axis=1)[apart]
    at = poses(robot.tree, np.zeros((1, 3)), np.eye(3)[None], robot.rest[None])
    distance = _between(_world(at, shapes), shapes, pairs)
    return Obstacles(shapes, pairs[distance[0] > 0])


def keep_apart(normal: Normal, at: Poses, robot: Robot, kept: Obstacles, margin: float, sigma: float) -> None:
    """Adds what is nearer than `margin` [m]: links to each other, links other than feet to the floor; `sigma` [m]."""
    ends = _world(at, kept.shapes)
    frame, pair = _near(ends, kept, margin)
    one, other = kept.pairs[pair].T
    length, first, second = _closest(ends[frame, one], ends[frame, other])
    distance = length - kept.shapes.radius[one] - kept.shapes.radius[other] - margin
    close = distance < 0
    if close.any():
        along = (first - second)[close] / np.maximum(length[close, None], 1e-9)
        frame, one, other = frame[close], kept.shapes.body[one[close]], kept.shapes.body[other[close]]
        rows = _rows(robot, at, frame, one, first[close], along)
        rows -= _rows(robot, at, frame, other, second[close], along)
        _add(normal, frame, rows, distance[close], sigma)
    low = ends[..., 2] - kept.shapes.radius[:, None] - margin
    frame, shape, end = np.nonzero((low < 0) & ~kept.shapes.foot[:, None])
    if len(frame):
        up = np.broadcast_to([0.0, 0.0, 1.0], (len(frame), 3))
        rows = _rows(robot, at, frame, kept.shapes.body[shape], ends[frame, shape, end], up)
        _add(normal, frame, rows, low[frame, shape, end], sigma)


def depths(at: Poses, kept: Obstacles) -> np.ndarray:
    """How deep the worst pair of links overlaps in each frame, (T,) [m], 0 where none does."""
    distance = _between(_world(at, kept.shapes), kept.shapes, kept.pairs)
    return np.maximum(-distance, 0).max(axis=1, initial=0)


def shape_heights(at: Poses, kept: Obstacles) -> np.ndarray:
    """Height of the lowest link other than the feet over the floor in each frame, (T,) [m], inf without such."""
    low = _world(at, kept.shapes)[..., 2] - kept.shapes.radius[:, None]
    return low[:, ~kept.shapes.foot].min(axis=(1, 2), initial=np.inf)


def _shapes(robot: Robot) -> Shapes:
    model, feet = robot.model, set(robot.sole_body.tolist())
    rows = []
    for geom in range(model.ngeom):
        body = int(model.geom_bodyid[geom]) - 1
        kind = mujoco.mjtGeom(int(model.geom_type[geom]))
        if body < 0 or body in feet or not model.geom_contype[geom] + model.geom_conaffinity[geom]:
            continue
        if kind in (mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_CAPSULE):
            half = model.geom_size[geom, 1] if kind == mujoco.mjtGeom.mjGEOM_CAPSULE else 0.0
            axis = quaternions.to_matrices(model.geom_quat[geom])[:, 2] * half
            ends = model.geom_pos[geom] + np.stack([-axis, axis])
            rows.append((body, ends, float(model.geom_size[geom, 0]), False))
    rows += [_foot(robot, side) for side in range(2)]
    bodies, places, radii, soles = zip(*rows, strict=True)
    return Shapes(np.array(bodies), np.array(places), np.array(radii), np.array(soles))


def _foot(robot: Robot, side: int) -> tuple[int, np.ndarray, float, bool]:
    """One capsule as wide as the sole, along its middle."""
    corners = robot.sole[side * CORNERS : (side + 1) * CORNERS]
    radius = robot.radius + float(np.linalg.norm(corners[0] - corners[1])) / 2
    heel, toe = corners[:2].mean(axis=0), corners[2:].mean(axis=0)
    axis = np.stack([heel, toe]) + np.array([0.0, 0.0, radius - robot.radius])
    return int(robot.sole_body[side * CORNERS]), axis, radius, True


def _hops(parent: np.ndarray) -> np.ndarray:
    """How many links lie between two bodies, (B, B)."""
    count = len(parent)
    hops = np.full((count, count), count, int)
    hops[np.arange(count), np.arange(count)] = 0
    for body in range(1, count):
        hops[body, :body] = hops[:body, body] = hops[parent[body], :body] + 1
    return hops


def _world(at: Poses, shapes: Shapes) -> np.ndarray:
    """Ends of all shapes in the world, (T, G, 2, 3) [m]."""
    turned = np.einsum("tgij,gej->tgei", at.rot[:, shapes.body], shapes.ends)
    return at.pos[:, shapes.body, None] + turned


def _near(ends: np.ndarray, kept: Obstacles, margin: float) -> tuple[np.ndarray, np.ndarray]:
    """Frames and pairs (E,) whose balls around the shapes meet: all others are apart, and most are."""
    centre = ends.mean(axis=2)
    reach = kept.shapes.radius + np.linalg.norm(kept.shapes.ends[:, 1] - kept.shapes.ends[:, 0], axis=1) / 2
    first, second = kept.pairs.T
    gap = centre[:, first] - centre[:, second]
    frames, pairs = np.nonzero(_dot(gap, gap) < (reach[first] + reach[second] + margin) ** 2)
    return frames, pairs


def _between(ends: np.ndarray, shapes: Shapes, pairs: np.ndarray) -> np.ndarray:
    """Distances between the surfaces of pairs, (T, P) [m], negative where they overlap."""
    length = _closest(ends[:, pairs[:, 0]], ends[:, pairs[:, 1]])[0]
    return length - shapes.radius[pairs[:, 0]] - shapes.radius[pairs[:, 1]]


def _closest(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distance of two segments with ends (..., 2, 3) [m], and the point of each that is nearest to the other."""
    u, v, w = a[..., 1, :] - a[..., 0, :], b[..., 1, :] - b[..., 0, :], a[..., 0, :] - b[..., 0, :]
    uu, vv, uv = _dot(u, u), _dot(v, v), _dot(u, v)
    uw, vw = _dot(u, w), _dot(v, w)
    tiny = 1e-12
    # Nearest points of two segments: free on the first, then clamped on the second, then on the first again.
    s = np.clip((uv * vw - vv * uw) / np.maximum(uu * vv - uv * uv, tiny), 0, 1)
    t = np.clip((uv * s + vw) / np.maximum(vv, tiny), 0, 1)
    s = np.clip((uv * t - uw) / np.maximum(uu, tiny), 0, 1)
    first, second = a[..., 0, :] + s[..., None] * u, b[..., 0, :] + t[..., None] * v
    return np.linalg.norm(first - second, axis=-1), first, second


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...i,...i->...", a, b)


def _rows(
    robot: Robot, at: Poses, frame: np.ndarray, body: np.ndarray, where: np.ndarray, along: np.ndarray
) -> np.ndarray:
    """Derivatives (E, 6 + n) of points `where` (E, 3) on bodies (E,), each in its frame along a direction (E, 3)."""
    rows = np.empty((len(frame), 6 + len(robot.tree.joints)))
    rows[:, :3] = along
    rows[:, 3:6] = np.cross(where - at.pos[frame, 0], along)
    lever = where[:, None] - at.origin[frame]
    rows[:, 6:] = _dot(np.cross(at.axis[frame], lever), along[:, None]) * robot.tree.moves[body]
    return rows


def _add(normal: Normal, frame: np.ndarray, rows: np.ndarray, residual: np.ndarray, sigma: float) -> None:
    """Adds single residuals (E,) with their rows (E, 6 + n) to their frames."""
    weight = sigma**-2.0
    normal.cost += weight * float(np.square(residual).sum())
    np.add.at(normal.slope, frame, weight * rows * residual[:, None])
    np.add.at(normal.blocks[0], frame, weight * rows[:, :, None] * rows[:, None, :])
