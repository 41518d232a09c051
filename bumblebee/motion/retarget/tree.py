"""A robot's kinematics over all frames of a motion at once: poses, points on bodies, and their Jacobians."""

from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee import quaternions
from bumblebee.errors import BadInput


@dataclass(frozen=True, eq=False)
class Tree:
    """Bodies (B) below a free joint with hinges (n), in MuJoCo's order; body 0 is the root.

    `parent` (B,), `offset` (B, 3) [m] and `turn` (B, 3, 3) in the parent's frame; `joint_body` (n,), `axis` (n, 3) and
    `anchor` (n, 3) [m] in the body's frame; `low`, `high` (n,) [rad]; `moves` (B, n) whether a joint moves a body.
    """

    bodies: tuple[str, ...]
    joints: tuple[str, ...]
    parent: np.ndarray
    offset: np.ndarray
    turn: np.ndarray
    joint_body: np.ndarray
    axis: np.ndarray
    anchor: np.ndarray
    low: np.ndarray
    high: np.ndarray
    moves: np.ndarray


@dataclass(frozen=True, eq=False)
class Poses:
    """World poses of all bodies and hinges: `pos` (T, B, 3), `rot` (T, B, 3, 3), `axis`, `origin` (T, n, 3)."""

    pos: np.ndarray
    rot: np.ndarray
    axis: np.ndarray
    origin: np.ndarray


def tree_of(model: mujoco.MjModel, where: object = "the robot's model") -> Tree:
    """The kinematic tree of a model whose first body floats and whose other joints are hinges, several a body or none.

    Raises:
        BadInput: no free joint at the first body, a slide or ball joint, a body that does not belong to the robot.
    """
    if model.nbody < 2 or model.njnt < 2 or model.jnt_type[0] != mujoco.mjtJoint.mjJNT_FREE or model.jnt_bodyid[0] != 1:
        raise BadInput(where, "a free joint on the first body", "none", "Give the robot's pelvis a freejoint.")
    for j in range(1, model.njnt):
        if model.jnt_type[j] != mujoco.mjtJoint.mjJNT_HINGE:
            raise BadInput(f"{where}: joint {model.joint(j).name}", "a hinge", "another type of joint")
    for b in range(2, model.nbody):
        if model.body_rootid[b] != 1:
            came = f"body {model.body(b).name or b} apart from it"
            raise BadInput(where, "one robot", came, "Give the robot's own file, not a scene.")
    bodies = model.nbody - 1
    joint_body = model.jnt_bodyid[1:] - 1
    parent = model.body_parentid[1:] - 1
    moves = np.zeros((bodies, len(joint_body)), bool)
    for b in range(bodies):
        if parent[b] >= 0:
            moves[b] = moves[parent[b]]
        moves[b, joint_body == b] = True
    limited = model.jnt_limited[1:].astype(bool)
    return Tree(
        tuple(model.body(b + 1).name for b in range(bodies)),
        tuple(model.joint(j).name for j in range(1, model.njnt)),
        parent,
        model.body_pos[1:].copy(),
        quaternions.to_matrices(model.body_quat[1:]),
        joint_body,
        model.jnt_axis[1:].copy(),
        model.jnt_pos[1:].copy(),
        np.where(limited, model.jnt_range[1:, 0], -np.inf),
        np.where(limited, model.jnt_range[1:, 1], np.inf),
        moves,
    )


def turns(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rotation matrices (T, 3, 3) about one axis (3,) by angles (T,) [rad]."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sine, cosine = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + sine * cross + (1 - cosine) * (cross @ cross)


def poses(tree: Tree, root_pos: np.ndarray, root_rot: np.ndarray, joint_pos: np.ndarray) -> Poses:
    """Forward kinematics from the root (T, 3) [m], (T, 3, 3) and the joints (T, n) [rad]."""
    frames, bodies, count = len(root_pos), len(tree.bodies), len(tree.joints)
    pos, rot = np.empty((bodies, frames, 3)), np.empty((bodies, frames, 3, 3))
    axis, origin = np.empty((count, frames, 3)), np.empty((count, frames, 3))
    pos[0], rot[0] = root_pos, root_rot
    for b in range(1, bodies):
        above = tree.parent[b]
        pos[b] = pos[above] + rot[above] @ tree.offset[b]
        rot[b] = rot[above] @ tree.turn[b]
        for j in np.flatnonzero(tree.joint_body == b):
            axis[j] = rot[b] @ tree.axis[j]
            origin[j] = pos[b] + rot[b] @ tree.anchor[j]
            rot[b] = rot[b] @ turns(tree.axis[j], joint_pos[:, j])
            pos[b] = origin[j] - rot[b] @ tree.anchor[j]
    return Poses(*(np.moveaxis(array, 0, 1) for array in (pos, rot, axis, origin)))


def points(at: Poses, body: np.ndarray, local: np.ndarray) -> np.ndarray:
    """World positions (T, K, 3) [m] of points `local` (K, 3) [m] fixed to bodies `body` (K,)."""
    return at.pos[:, body] + np.einsum("tkij,kj->tki", at.rot[:, body], local)


def jacobian(tree: Tree, at: Poses, body: np.ndarray, where: np.ndarray) -> np.ndarray:
    """Derivatives (T, K, 3, 6 + n) of points at `where` (T, K, 3) on bodies `body` (K,).

    Columns: the root's translation [m, world], its rotation vector [rad, world], the joints [rad].
    """
    frames, count = where.shape[:2]
    out = np.zeros((frames, count, 3, 6 + len(tree.joints)))
    out[..., :3] = np.eye(3)
    arm = where - at.pos[:, :1]
    out[:, :, 0, 4], out[:, :, 0, 5] = arm[..., 2], -arm[..., 1]
    out[:, :, 1, 3], out[:, :, 1, 5] = -arm[..., 2], arm[..., 0]
    out[:, :, 2, 3], out[:, :, 2, 4] = arm[..., 1], -arm[..., 0]
    moves = tree.moves[body]  # (K, n)
    for j in np.flatnonzero(moves.any(axis=0)):
        moved = np.flatnonzero(moves[:, j])
        lever, about = where[:, moved] - at.origin[:, None, j], at.axis[:, None, j]
        out[:, moved, 0, 6 + j] = about[..., 1] * lever[..., 2] - about[..., 2] * lever[..., 1]
        out[:, moved, 1, 6 + j] = about[..., 2] * lever[..., 0] - about[..., 0] * lever[..., 2]
        out[:, moved, 2, 6 + j] = about[..., 0] * lever[..., 1] - about[..., 1] * lever[..., 0]
    return out
