"""Quaternions in torch, batched, wxyz."""

import numpy as np
import torch
from torch import Tensor

_NONE = 1e-20  # below this the square of a length is none, and has no gradient: that of a root at 0 is infinite


def multiply(a: Tensor, b: Tensor) -> Tensor:
    """Hamilton product of (..., 4) with (..., 4)."""
    # All sixteen products at once: small operations cost a CPU more than their arithmetic.
    products = (a[..., :, None] * b[..., None, :]).flatten(-2).unbind(-1)
    ww, wx, wy, wz, xw, xx, xy, xz, yw, yx, yy, yz, zw, zx, zy, zz = products
    parts = (ww - xx - yy - zz, wx + xw + yz - zy, wy - xz + yw + zx, wz + xy - yx + zw)
    return torch.stack(parts, dim=-1)


def conjugate(q: Tensor) -> Tensor:
    """Inverse rotation of unit quaternions (..., 4)."""
    return torch.cat((q[..., :1], -q[..., 1:]), dim=-1)


def matrix(q: Tensor) -> Tensor:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4); columns are the rotated axes."""
    return torch.stack(_entries(q), dim=-1).unflatten(-1, (3, 3))


def two_columns(q: Tensor) -> Tensor:
    """The rotated x and y axes (..., 2, 3) of unit quaternions (..., 4)."""
    one, two, _, four, five, _, seven, eight, _ = _entries(q)
    return torch.stack((one, four, seven, two, five, eight), dim=-1).unflatten(-1, (2, 3))


def up_axis(q: Tensor) -> Tensor:
    """The rotated z axis (..., 3) of unit quaternions (..., 4)."""
    w, x, y, z = q.unbind(-1)
    return torch.stack((2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)), dim=-1)


def _entries(q: Tensor) -> tuple[Tensor, ...]:
    """The nine entries (...,) of the matrices of quaternions (..., 4), row by row."""
    parts = q.movedim(-1, 0).contiguous()  # columns of their own, three at a time: faster on a CPU
    w, v = parts[:1], parts[1:]
    twice = v + v
    xx, yy, zz = (v * twice).unbind(0)
    about = (w * twice).flip(0)  # wz, wy, wx
    mixed = torch.cat((v[:1] * twice[1:], v[1:2] * twice[2:]))  # xy, xz, yz
    one, five, nine = (1 - torch.stack((yy + zz, xx + zz, xx + yy))).unbind(0)
    four, three, eight = (mixed + about).unbind(0)
    two, seven, six = (mixed - about).unbind(0)
    return one, two, three, four, five, six, seven, eight, nine


def turned(vectors: Tensor, matrices: Tensor) -> Tensor:
    """Vectors (B, N, 3), each turned by its row's matrix (B, 3, 3)."""
    learnt = torch.is_grad_enabled() and (vectors.requires_grad or matrices.requires_grad)
    if vectors.device.type == "cpu" and not learnt and not torch.compiler.is_compiling():
        # A third of the time that torch takes for so small products.
        return torch.from_numpy(np.matmul(vectors.numpy(), matrices.mT.contiguous().numpy()))
    return turned_in_full(vectors, matrices)


def turned_in_full(vectors: Tensor, matrices: Tensor) -> Tensor:
    """Rotation by sums of products: a GPU's own product may round its factors to ten bits (TF32)."""
    return (vectors[:, :, None] * matrices[:, None]).sum(-1)


def rotate(q: Tensor, v: Tensor) -> Tensor:
    """Vectors (..., 3) rotated by q (..., 4): base to world if q is the base's orientation."""
    w, axis = _parts(q)
    half = torch.linalg.cross(axis, v)
    t = half + half
    return v + w * t + torch.linalg.cross(axis, t)


def rotate_inverse(q: Tensor, v: Tensor) -> Tensor:
    """Vectors (..., 3) rotated by the inverse of q: world to base if q is the base's orientation."""
    w, axis = _parts(q)
    half = torch.linalg.cross(v, axis)  # of the inverse, whose axis points the other way
    t = half + half
    return v + w * t + torch.linalg.cross(t, axis)


def angle_between(a: Tensor, b: Tensor) -> Tensor:
    """Angle [rad] in [0, pi] of the rotation from a to b, (...,)."""
    (aw, av), (bw, bv) = _parts(a), _parts(b)
    sine = length3(aw * bv - bw * av - torch.linalg.cross(av, bv))
    return 2 * torch.atan2(sine, (a * b).sum(-1).abs())


def length3(v: Tensor) -> Tensor:
    """Lengths (...,) of vectors (..., 3)."""
    # By component: reducing rows of three costs a CPU twice as much.
    x, y, z = v.square().unbind(-1)
    return (x + y + z).clamp(min=_NONE).sqrt()


def from_rotation_vector(v: Tensor) -> Tensor:
    """Unit quaternions (..., 4) of rotation vectors (..., 3) [rad]."""
    angle = v.norm(dim=-1, keepdim=True)
    half = 0.5 * angle
    scale = torch.where(angle > 1e-6, torch.sin(half) / angle.clamp(min=1e-6), torch.full_like(angle, 0.5))
    return torch.cat((torch.cos(half), scale * v), dim=-1)


def _parts(q: Tensor) -> tuple[Tensor, Tensor]:
    """Scalar (..., 1) and vector (..., 3) of quaternions (..., 4)."""
    return q[..., :1], q[..., 1:]
