"""The robot's state as one vector: what the world model predicts, and how it becomes the state that the task sees.

Columns of a state (B, 13 + 2 J): root position in the world [m], orientation wxyz, velocity [m/s] and angular velocity
[rad/s] in the root's own frame, joint angles [rad], joint velocities [rad/s].
"""

import torch
from torch import Tensor

from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import conjugate, from_rotation_vector, multiply, rotate, rotate_inverse

POSE, ROOT = 7, 13  # columns of the root's pose, and of the root's pose and velocities


def packed(state: RobotState) -> Tensor:
    """The state of B robots as (B, 13 + 2 J)."""
    parts = (state.root_pos_w, state.root_quat_w, state.root_lin_vel_b, state.root_ang_vel_b)
    return torch.cat((*parts, state.joint_pos, state.joint_vel), dim=-1)


def unpacked(body: Tensor, key_pos_w: Tensor) -> RobotState:
    """The state that the task sees.

    Args:
        body: (B, 13 + 2 J).
        key_pos_w: (B, K, 3) [m] of its key bodies, by forward kinematics.
    """
    joints = (body.shape[-1] - ROOT) // 2
    position, quat, linear, angular, angle, speed = body.split((3, 4, 3, 3, joints, joints), dim=-1)
    return RobotState(position, quat, linear, angular, angle, speed, key_pos_w)


def joint_pos(body: Tensor) -> Tensor:
    """Joint angles (B, J) [rad] of states (B, 13 + 2 J)."""
    return body[..., ROOT : ROOT + (body.shape[-1] - ROOT) // 2]


def name_of(entry: int, size: int) -> str:
    """Name an entry of a state of `size` = 13 + 2 J entries."""
    joints = (size - ROOT) // 2
    if entry < ROOT:
        return ("root position", "root orientation", "root velocity", "root angular velocity")[
            (entry >= 3) + (entry >= POSE) + (entry >= POSE + 3)
        ]
    return f"{'angle' if entry < ROOT + joints else 'velocity'} of joint {(entry - ROOT) % joints}"


def features(body: Tensor) -> Tensor:
    """Everything of a state that physics depends on (B, 10 + 2 J): no place in the plane, no heading."""
    down = torch.zeros_like(body[..., :3])
    down[..., 2] = -1.0
    gravity_b = rotate_inverse(body[..., 3:POSE], down)
    return torch.cat((body[..., 2:3], gravity_b, body[..., POSE:]), dim=-1)


def moved(body: Tensor, change: Tensor, dt: float) -> Tensor:
    """The state one control step later.

    Args:
        body: (B, 13 + 2 J).
        change: (B, 12 + 2 J), beyond uniform motion: displacement [m] and turn [rad] of the root in its own frame,
            changes of its velocities, changes of joint angles and velocities.
        dt: control period [s].
    """
    joints = (body.shape[-1] - ROOT) // 2
    shift, turn, velocity, angle, speed = change.split((3, 3, 6, joints, joints), dim=-1)
    quat = body[..., 3:POSE]
    position = body[..., :3] + rotate(quat, dt * body[..., POSE : POSE + 3] + shift)
    turned = multiply(quat, from_rotation_vector(dt * body[..., POSE + 3 : ROOT] + turn))
    turned = torch.nn.functional.normalize(turned, dim=-1)
    angles = joint_pos(body) + dt * body[..., ROOT + joints :] + angle
    return torch.cat(
        (position, turned, body[..., POSE:ROOT] + velocity, angles, body[..., ROOT + joints :] + speed), -1
    )


def difference(body: Tensor, other: Tensor) -> Tensor:
    """How far `body` is from `other`, both (B, 13 + 2 J), in the root frame of `other`.

    Returns:
        (B, 12 + 2 J): place [m], turn [rad, small angles], velocities, joint angles and velocities.
    """
    quat = other[..., 3:POSE]
    place = rotate_inverse(quat, body[..., :3] - other[..., :3])
    turn = multiply(conjugate(quat), body[..., 3:POSE])
    small = 2 * turn[..., 1:] * torch.where(turn[..., :1] < 0, -1.0, 1.0)
    return torch.cat((place, small, body[..., POSE:] - other[..., POSE:]), dim=-1)


def change_of(body: Tensor, after: Tensor, dt: float) -> Tensor:
    """The change (B, 12 + 2 J) for which `moved` gives `after`, for turns of less than half a turn a step."""
    uniform = moved(body, torch.zeros_like(body[..., 1:]), dt)
    beyond = difference(after, uniform)
    beyond[..., :3] = rotate_inverse(body[..., 3:POSE], after[..., :3] - uniform[..., :3])
    return beyond
