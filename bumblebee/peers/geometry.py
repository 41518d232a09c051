"""Geometry that the other groups' observations need beside our own: heading, roll-pitch-yaw, a point in the head."""

import math

import torch
from torch import Tensor

from bumblebee.robot.facts import HEAD, joint_names, path_to, robot_bodies
from bumblebee.sim.rotations import from_rotation_vector, multiply, rotate

_HEAD_BODY, _HEAD = HEAD


def heading_inverse(quat: Tensor) -> Tensor:
    """Rotation (B, 4) about the vertical that takes a body with orientation `quat` (B, 4) back to heading 0.

    The heading is that of the body's x axis in the floor's plane, as in the public code of OmniH2O and HOVER.
    """
    w, x, y, z = quat.unbind(-1)
    half = 0.5 * torch.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))
    zero = torch.zeros_like(half)
    return torch.stack((torch.cos(half), zero, zero, -torch.sin(half)), dim=-1)


def turned(quat: Tensor, vectors: Tensor) -> Tensor:
    """Vectors (B, N, 3) each rotated by its robot's quat (B, 4), flattened to (B, 3 N)."""
    return rotate(quat[:, None].expand(-1, vectors.shape[1], -1), vectors).flatten(1)


def roll_pitch_yaw(quat: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Angles (B,) [rad] about x, y and z, turned in that order about the world's axes."""
    w, x, y, z = quat.unbind(-1)
    roll = torch.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = torch.asin((2 * (w * y - z * x)).clamp(-1.0, 1.0))
    return roll, pitch, torch.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def wrapped(angle: Tensor) -> Tensor:
    """The angle in [-pi, pi) [rad]."""
    return torch.remainder(angle + math.pi, 2 * math.pi) - math.pi


def head_pos_w(root_pos_w: Tensor, root_quat_w: Tensor, joint_pos: Tensor) -> Tensor:
    """The middle of the head (B, 3) [m] in the world, by forward kinematics of the waist.

    Args:
        root_pos_w: (B, 3) [m] of the pelvis.
        root_quat_w: (B, 4) of the pelvis.
        joint_pos: (B, 23) [rad].
    """
    place, quat = root_pos_w, root_quat_w
    for body in path_to(_HEAD_BODY)[1:]:
        facts = robot_bodies()[body]
        place = place + rotate(quat, _fixed(facts["pos"], place))
        joint = facts["joint"]
        angle = joint_pos[:, joint_names().index(joint["name"]), None]
        quat = multiply(quat, from_rotation_vector(angle * _fixed(joint["axis"], place)))
    return place + rotate(quat, _fixed(_HEAD, place))


def _fixed(values: tuple[float, ...], like: Tensor) -> Tensor:
    """Three numbers as (B, 3), made without a copy from the host, which a recorded CUDA graph could not hold."""
    return torch.stack([torch.full_like(like[:, 0], float(value)) for value in values], dim=-1)
