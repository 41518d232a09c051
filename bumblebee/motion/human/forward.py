"""Forward kinematics of skeletons, vectorised over the frames: from angles of joints to positions of joints."""

from collections.abc import Container, Iterable, Sequence

import numpy as np

from bumblebee.motion.human.bvh import Bvh

_BLOCK = 4096  # frames at a time: what is at work stays small, however long the motion


def bvh_positions(bvh: Bvh, joints: Sequence[int]) -> np.ndarray:
    """Positions of some joints, (T, len(joints), 3) in the file's unit and axes.

    A joint's rotations apply in the order of their channels, each about the axis as the ones before have turned it.
    Only the chains to these joints are walked.
    """
    chain = sorted(_with_parents(bvh.parents, joints))
    added = {joint for joint in chain if adds_positions(bvh, joint)}
    blocks = [bvh.values[start : start + _BLOCK] for start in range(0, len(bvh.values), _BLOCK)]
    return np.concatenate([_block(bvh, values, chain, added)[:, list(joints)] for values in blocks])


def _block(bvh: Bvh, values: np.ndarray, chain: Sequence[int], added: Container[int]) -> np.ndarray:
    """Positions of the joints of `chain` for some frames, (T, J, 3); those of the others are zero."""
    first = bvh.first_channel
    places = np.zeros((len(values), len(bvh.parents), 3))
    rotations = {-1: np.broadcast_to(np.eye(3), (len(values), 3, 3))}
    for joint in chain:
        parent, channels = bvh.parents[joint], list(enumerate(bvh.channels[joint], first[joint]))
        offset = np.tile(bvh.offsets[joint], (len(values), 1))
        for column, (kind, axis) in channels:
            if kind == "position":
                offset[:, axis] = values[:, column] + (bvh.offsets[joint, axis] if joint in added else 0.0)
        rotation = rotations[parent]
        places[:, joint] = np.einsum("tij,tj->ti", rotation, offset)
        if parent >= 0:
            places[:, joint] += places[:, parent]
        for column, (kind, axis) in channels:
            if kind == "rotation":
                rotation = _turned(rotation, axis, np.radians(values[:, column]))
        rotations[joint] = rotation
    return places


def bone_offsets(bvh: Bvh) -> np.ndarray:
    """Offset of each joint from its parent, (J, 3) in the file's unit; the median where positions replace it."""
    offsets = bvh.offsets.copy()
    for joint in range(len(bvh.parents)):
        columns, axes = _positions(bvh, joint)
        if bvh.parents[joint] >= 0 and columns and not adds_positions(bvh, joint):
            offsets[joint, axes] = np.median(bvh.values[:, columns], axis=0)
    return offsets


def rest_positions(bvh: Bvh, joints: Sequence[int]) -> np.ndarray:
    """Positions of some joints in the hierarchy's own pose, all angles zero, (len(joints), 3) in the file's unit."""
    places = np.zeros((len(bvh.parents), 3))
    for joint, parent in enumerate(bvh.parents):
        if parent >= 0:
            places[joint] = places[parent] + bvh.offsets[joint]
    return places[list(joints)]


def adds_positions(bvh: Bvh, joint: int) -> bool:
    """Whether a joint's position channels are meant on top of its OFFSET rather than in its place.

    Programs differ. The root's are always its place. For another joint the two are told apart by the values: they stay
    near OFFSET where they replace it, and near zero where they are added to it.
    """
    columns, axes = _positions(bvh, joint)
    if bvh.parents[joint] < 0 or not columns:
        return False
    offset = bvh.offsets[joint, axes]
    middle = np.median(bvh.values[:, columns], axis=0)
    return bool(np.linalg.norm(middle) < np.linalg.norm(middle - offset))


def _positions(bvh: Bvh, joint: int) -> tuple[list[int], list[int]]:
    """The columns of a joint's position channels, and their axes."""
    first = bvh.first_channel[joint]
    found = [(first + i, axis) for i, (kind, axis) in enumerate(bvh.channels[joint]) if kind == "position"]
    return [column for column, _ in found], [axis for _, axis in found]


def _with_parents(parents: Sequence[int], joints: Iterable[int]) -> set[int]:
    found: set[int] = set()
    for joint in joints:
        while joint >= 0 and joint not in found:
            found.add(joint)
            joint = parents[joint]
    return found


def _turned(rotation: np.ndarray, axis: int, angle: np.ndarray) -> np.ndarray:
    """`rotation` (T, 3, 3) times the turn by `angle` (T,) [rad] about one of its own axes."""
    one, two = (axis + 1) % 3, (axis + 2) % 3
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    out = np.empty(rotation.shape)
    out[:, :, axis] = rotation[:, :, axis]
    out[:, :, one] = cos * rotation[:, :, one] + sin * rotation[:, :, two]
    out[:, :, two] = cos * rotation[:, :, two] - sin * rotation[:, :, one]
    return out


def axis_angle_positions(
    root: np.ndarray, angles: np.ndarray, offsets: np.ndarray, parents: Sequence[int]
) -> np.ndarray:
    """Positions of joints whose rotations are given as axis times angle.

    Args:
        root: place of the first joint, (T, 3) [m].
        angles: (T, J, 3) [rad], each in its parent's frame.
        offsets: of each joint in its parent's frame, (J, 3) [m]; the first one's is not used.
        parents: index of each joint's parent, smaller than its own.

    Returns:
        (T, J, 3) [m].
    """
    local = _matrices(angles)
    turned, out = np.empty_like(local), np.empty(angles.shape)
    for joint, parent in enumerate(parents):
        turned[:, joint] = local[:, joint] if joint == 0 else turned[:, parent] @ local[:, joint]
        out[:, joint] = root if joint == 0 else out[:, parent] + turned[:, parent] @ offsets[joint]
    return out


def _matrices(vectors: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) [rad], after Rodrigues."""
    angle = np.linalg.norm(vectors, axis=-1)
    x, y, z = np.moveaxis(vectors, -1, 0)
    none = np.zeros_like(x)
    cross = np.stack([none, -z, y, z, none, -x, -y, x, none], axis=-1).reshape(*x.shape, 3, 3)
    sine = np.sinc(angle / np.pi)[..., None, None]
    half = (0.5 * np.sinc(angle / (2 * np.pi)) ** 2)[..., None, None]
    return np.eye(3) + sine * cross + half * (cross @ cross)
