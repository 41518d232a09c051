"""Terms of observation of OmniH2O, which HOVER's teacher shares; `_h` marks the heading frame.

The heading frame has its origin in the robot's root, its z axis up, and turns with the robot's heading alone. Points
are the 14 key bodies and the head. The teacher of the public code sees places, rotations, velocities and angular
velocities of 23 bodies; here the rotations and speeds of all bodies but the root are given by joint angles and joint
speeds, which determine them.
"""

import torch
from torch import Tensor

from benchmarks.baselines.others.h2o_rows import HANDS
from benchmarks.baselines.others.library import key_vel_w
from bumblebee.peers.geometry import head_pos_w, heading_inverse, turned
from bumblebee.robot.facts import KEY_BODIES
from bumblebee.sim.rotations import conjugate, matrix, multiply, rotate
from bumblebee.tracking.observing.terms import Seen

POINTS = len(KEY_BODIES) + 1
"""The key bodies and the head."""
HEAD = POINTS - 1


def h2o_points_h(seen: Seen) -> Tensor:
    """The robot's points from its root (B, 3 P) [m]."""
    return turned(_heading(seen), _points(seen) - seen.state.root_pos_w[:, None])


def h2o_rotation_h(seen: Seen) -> Tensor:
    """The root's orientation less its heading (B, 6)."""
    return _six(multiply(_heading(seen), seen.state.root_quat_w))


def h2o_lin_vel_h(seen: Seen) -> Tensor:
    """Velocity of the root (B, 3) [m/s]."""
    return rotate(_heading(seen), rotate(seen.state.root_quat_w, seen.state.root_lin_vel_b))


def h2o_ang_vel_h(seen: Seen) -> Tensor:
    """Angular velocity of the root (B, 3) [rad/s]."""
    return rotate(_heading(seen), rotate(seen.state.root_quat_w, seen.state.root_ang_vel_b))


def h2o_point_errors_h(seen: Seen) -> Tensor:
    """From the robot's points to the reference's (B, 3 P) [m]."""
    return turned(_heading(seen), _target_points(seen) - _points(seen))


def h2o_rotation_error_h(seen: Seen) -> Tensor:
    """Rotation from the robot's root to the reference's (B, 6), about the heading frame's axes."""
    heading = _heading(seen)
    away = multiply(seen.ref.root_quat_w, conjugate(seen.state.root_quat_w))
    return _six(multiply(multiply(heading, away), conjugate(heading)))


def h2o_lin_vel_error_h(seen: Seen) -> Tensor:
    """From the root's velocity to the reference's (B, 3) [m/s]."""
    return rotate(_heading(seen), seen.ref.root_lin_vel_w) - h2o_lin_vel_h(seen)


def h2o_ang_vel_error_h(seen: Seen) -> Tensor:
    """From the root's angular velocity to the reference's (B, 3) [rad/s]."""
    return rotate(_heading(seen), rotate(seen.ref.root_quat_w, seen.ref.root_ang_vel_b)) - h2o_ang_vel_h(seen)


def h2o_joint_errors(seen: Seen) -> Tensor:
    """From the joints' angles to the reference's (B, J) [rad]."""
    return seen.ref.joint_pos - seen.state.joint_pos


def h2o_joint_vel_errors(seen: Seen) -> Tensor:
    """From the joints' speeds to the reference's (B, J) [rad/s]."""
    return seen.ref.joint_vel - seen.state.joint_vel


def h2o_target_points_h(seen: Seen) -> Tensor:
    """The reference's points from the robot's root (B, 3 P) [m]."""
    return turned(_heading(seen), _target_points(seen) - seen.state.root_pos_w[:, None])


def h2o_target_rotation_h(seen: Seen) -> Tensor:
    """The reference's orientation less the robot's heading (B, 6)."""
    return _six(multiply(_heading(seen), seen.ref.root_quat_w))


def h2o_three_errors_h(seen: Seen) -> Tensor:
    """Student: from the robot's hands and head to the reference's (B, 9) [m]."""
    return _three(h2o_point_errors_h(seen))


def h2o_three_targets_h(seen: Seen) -> Tensor:
    """Student: the reference's hands and head from the robot's root (B, 9) [m]."""
    return _three(h2o_target_points_h(seen))


def h2o_three_speeds_h(seen: Seen) -> Tensor:
    """Student: velocities of the reference's hands and root (B, 9) [m/s]; their head is fixed to the root."""
    hands = key_vel_w(seen.ref)
    moving = torch.stack((*(hands[:, hand] for hand in HANDS), seen.ref.root_lin_vel_w), dim=1)
    return turned(_heading(seen), moving)


SIZES = {
    h2o_points_h: 3 * POINTS,
    h2o_rotation_h: 6,
    h2o_lin_vel_h: 3,
    h2o_ang_vel_h: 3,
    h2o_point_errors_h: 3 * POINTS,
    h2o_rotation_error_h: 6,
    h2o_lin_vel_error_h: 3,
    h2o_ang_vel_error_h: 3,
    h2o_joint_errors: None,
    h2o_joint_vel_errors: None,
    h2o_target_points_h: 3 * POINTS,
    h2o_target_rotation_h: 6,
    h2o_three_errors_h: 9,
    h2o_three_targets_h: 9,
    h2o_three_speeds_h: 9,
}
"""Entries of each term; None: one a joint."""

NOISE = {
    "h2o_points_h": 0.01,
    "h2o_rotation_h": 0.01,
    "h2o_lin_vel_h": 0.01,
    "h2o_ang_vel_h": 0.01,
    "h2o_point_errors_h": 0.05,
    "h2o_rotation_error_h": 0.01,
    "h2o_target_points_h": 0.01,
    "h2o_target_rotation_h": 0.01,
}
"""Largest error of the teacher's terms, as in the public code; students are distilled without noise."""


def _heading(seen: Seen) -> Tensor:
    return heading_inverse(seen.state.root_quat_w)


def _points(seen: Seen) -> Tensor:
    state = seen.state
    head = head_pos_w(state.root_pos_w, state.root_quat_w, state.joint_pos)
    return torch.cat((seen.key_pos_w, head[:, None]), dim=1)


def _target_points(seen: Seen) -> Tensor:
    ref = seen.ref
    head = head_pos_w(ref.root_pos_w, ref.root_quat_w, ref.joint_pos)
    return torch.cat((ref.key_pos_w, head[:, None]), dim=1)


def _three(points: Tensor) -> Tensor:
    """Hands and head (B, 9) of points (B, 3 P)."""
    return torch.cat([points[:, 3 * i : 3 * i + 3] for i in (*HANDS, HEAD)], dim=-1)


def _six(quat: Tensor) -> Tensor:
    """First two columns of the rotation matrix, (B, 6)."""
    return matrix(quat)[..., :2].flatten(-2)
