"""Unit quaternions as arrays (..., 4), scalar first (wxyz), Hamilton convention.

`multiply` and `rotate` are there twice, written out and by numpy's cross products: the last bits differ, and with them
the last digits of all that is computed from logs. New code takes those written out, which are faster.
"""

import numpy as np
from numpy.typing import ArrayLike

FloatArray = np.ndarray


def multiply(left: ArrayLike, right: ArrayLike) -> FloatArray:
    """Product `left * right` (..., 4): the rotation `right` followed by `left`."""
    (w1, x1, y1, z1), (w2, x2, y2, z2) = _parts(left), _parts(right)
    return _joined(
        w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2,
        w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2,
        w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
        w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2,
    )


def multiply_by_cross(left: FloatArray, right: FloatArray) -> FloatArray:
    """Quaternion product (..., 4) from scalar and vector parts."""
    scalar = left[..., :1] * right[..., :1] - (left[..., 1:] * right[..., 1:]).sum(axis=-1, keepdims=True)
    crossed = np.cross(left[..., 1:], right[..., 1:])
    vector = left[..., :1] * right[..., 1:] + right[..., :1] * left[..., 1:] + crossed
    return np.concatenate([scalar, vector], axis=-1)


def conjugate(quat: ArrayLike) -> FloatArray:
    """The inverse rotation (..., 4)."""
    return np.asarray(quat) * np.array([1.0, -1.0, -1.0, -1.0])


def rotate(quat: ArrayLike, vector: ArrayLike) -> FloatArray:
    """Rotate vectors (..., 3) by quaternions (..., 4); leading axes broadcast."""
    (w, x, y, z), (a, b, c) = _parts(quat), _parts(vector)
    # v + w t + r x t with t = 2 r x v, written out: numpy's cross is several times slower.
    ta, tb, tc = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
    return _joined(a + w * ta + y * tc - z * tb, b + w * tb + z * ta - x * tc, c + w * tc + x * tb - y * ta)


def rotate_by_cross(quat: FloatArray, vector: FloatArray) -> FloatArray:
    """Rotation of vectors (..., 3) by numpy's cross products."""
    twice = 2.0 * np.cross(quat[..., 1:], vector)
    return vector + quat[..., :1] * twice + np.cross(quat[..., 1:], twice)


def normalised(quat: ArrayLike) -> FloatArray:
    """Scaled to unit length (..., 4)."""
    quat = np.asarray(quat)
    return quat / np.linalg.norm(quat, axis=-1, keepdims=True)


def heading(quat: ArrayLike) -> FloatArray:
    """Rotations (..., 4) about the vertical that turn as far as `quat` does; upside down has none, and no turn."""
    w, _, _, z = _parts(quat)
    length = np.hypot(w, z)
    safe = np.where(length > 0, length, 1.0)
    return _joined(np.where(length > 0, w / safe, 1.0), 0 * w, 0 * w, z / safe)


def continuous(quat: ArrayLike) -> FloatArray:
    """Signs (T, 4) flipped so that neighbours are close; the first has w >= 0. The rotations stay the same."""
    quat = np.asarray(quat)
    flips = np.where(np.sum(quat[1:] * quat[:-1], axis=-1) < 0, -1.0, 1.0)
    first = -1.0 if len(quat) and quat[0, 0] < 0 else 1.0
    return quat * (first * np.concatenate([np.ones(min(len(quat), 1)), np.cumprod(flips)]))[:, None]


def from_axis_angle(axis: ArrayLike, angle: ArrayLike) -> FloatArray:
    """Rotation by `angle` (...,) [rad] about the unit vector `axis` (3,), as (..., 4)."""
    half = np.asarray(angle)[..., None] / 2
    return np.concatenate([np.cos(half), np.sin(half) * np.asarray(axis)], axis=-1)


def rotation_vector(quat: ArrayLike) -> FloatArray:
    """Logarithm (..., 3) [rad], the shorter way round."""
    quat = np.asarray(quat)
    quat = np.where(quat[..., :1] < 0, -quat, quat)
    sine = np.linalg.norm(quat[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, quat[..., :1])
    return quat[..., 1:] * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 2.0)


def from_rotation_vector(vector: FloatArray) -> FloatArray:
    """Unit quaternions (..., 4) of rotation vectors (..., 3) [rad]."""
    angle = np.linalg.norm(vector, axis=-1, keepdims=True)
    scale = np.where(angle > 1e-9, np.sin(angle / 2) / np.maximum(angle, 1e-9), 0.5)
    return np.concatenate((np.cos(angle / 2), vector * scale), axis=-1)


def to_matrices(quat: ArrayLike) -> FloatArray:
    """Rotation matrices (..., 3, 3), whose columns are the turned axes."""
    return np.stack([rotate(quat, unit) for unit in np.eye(3)], axis=-1)


def from_matrices(matrix: FloatArray) -> FloatArray:
    """Unit quaternions (..., 4) with w >= 0 of rotation matrices (..., 3, 3)."""
    from scipy.spatial.transform import Rotation

    flat = Rotation.from_matrix(matrix.reshape(-1, 3, 3)).as_quat(canonical=True, scalar_first=True)
    return flat.reshape(*matrix.shape[:-2], 4)


def slerp(start: ArrayLike, end: ArrayLike, share: ArrayLike) -> FloatArray:
    """Spherical interpolation (..., 4) from `start` (share 0) to `end` (share 1), the shorter way round."""
    start, share = np.asarray(start), np.asarray(share)
    vector = rotation_vector(multiply(conjugate(start), end)) * share[..., None]
    angle = np.linalg.norm(vector, axis=-1)
    axis = vector / np.maximum(angle, 1e-12)[..., None]
    turn = np.concatenate([np.cos(angle / 2)[..., None], np.sin(angle / 2)[..., None] * axis], axis=-1)
    return normalised(multiply(start, turn))


def _parts(array: ArrayLike) -> tuple[FloatArray, ...]:
    array = np.asarray(array)
    return tuple(array[..., i] for i in range(array.shape[-1]))


def _joined(*parts: FloatArray) -> FloatArray:
    joined = np.empty((*np.shape(parts[0]), len(parts)), dtype=np.result_type(*parts))
    for i, part in enumerate(parts):
        joined[..., i] = part
    return joined
