"""Quaternions in torch, batched, wxyz."""

import torch
from torch import Tensor


def multiply(a: Tensor, b: Tensor) -> Tensor:
    """Hamilton product of (..., 4) with (..., 4)."""
    aw, ax, ay, az = a.unbind(-1)
    bw, bx, by, bz = b.unbind(-1)
    return torch.stack(
        (
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ),
        dim=-1,
    )


def conjugate(q: Tensor) -> Tensor:
    """Inverse rotation of unit quaternions (..., 4)."""
    return torch.cat((q[..., :1], -q[..., 1:]), dim=-1)


def matrix(q: Tensor) -> Tensor:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4); columns are the rotated axes."""
    w, x, y, z = q.unbind(-1)
    rows = (
        1 - 2 * (y * y + z * z),
        2 * (x * y - w * z),
        2 * (x * z + w * y),
        2 * (x * y + w * z),
        1 - 2 * (x * x + z * z),
        2 * (y * z - w * x),
        2 * (x * z - w * y),
        2 * (y * z + w * x),
        1 - 2 * (x * x + y * y),
    )
    return torch.stack(rows, dim=-1).unflatten(-1, (3, 3))


def rotate(q: Tensor, v: Tensor) -> Tensor:
    """Vectors (..., 3) rotated by q (..., 4): base to world if q is the base's orientation."""
    axis = q[..., 1:]
    t = 2 * torch.linalg.cross(axis, v)
    return v + q[..., :1] * t + torch.linalg.cross(axis, t)


def rotate_inverse(q: Tensor, v: Tensor) -> Tensor:
    """Vectors (..., 3) rotated by the inverse of q: world to base if q is the base's orientation."""
    return rotate(conjugate(q), v)


def angle_between(a: Tensor, b: Tensor) -> Tensor:
    """Angle [rad] in [0, pi] of the rotation from a to b, (...,)."""
    relative = multiply(conjugate(a), b)
    return 2 * torch.atan2(relative[..., 1:].norm(dim=-1), relative[..., 0].abs())


def from_rotation_vector(v: Tensor) -> Tensor:
    """Unit quaternions (..., 4) of rotation vectors (..., 3) [rad]."""
    angle = v.norm(dim=-1, keepdim=True)
    half = 0.5 * angle
    scale = torch.where(angle > 1e-6, torch.sin(half) / angle.clamp(min=1e-6), torch.full_like(angle, 0.5))
    return torch.cat((torch.cos(half), scale * v), dim=-1)
