"""Terms of observation of Exbody2: velocities in the frames of robot and reference, key bodies without global drift.

What it follows of the place in the world is velocity alone: key bodies are compared after the reference's root was
moved over the robot's, at the reference's height.
"""

import torch
from torch import Tensor

from bumblebee.peers.geometry import roll_pitch_yaw
from bumblebee.robot.facts import KEY_BODIES, joint_names
from bumblebee.sim.rotations import matrix, rotate_inverse
from bumblebee.tracking.observing.terms import Seen
from bumblebee.tracking.sampling.library import over_robot

_KEYS = 3 * len(KEY_BODIES)
_UNSEEN = ("ankle", "waist_roll", "waist_pitch")
"""Joints whose speed the policy does not see."""


def ex_roll_pitch(seen: Seen) -> Tensor:
    """Roll and pitch of the root (B, 2) [rad]."""
    return torch.stack(roll_pitch_yaw(seen.state.root_quat_w)[:2], dim=-1)


def ex_yaw_error(seen: Seen) -> Tensor:
    """Sine and cosine (B, 2) of the robot's yaw less the reference's."""
    turn = roll_pitch_yaw(seen.state.root_quat_w)[2] - roll_pitch_yaw(seen.ref.root_quat_w)[2]
    return torch.stack((torch.sin(turn), torch.cos(turn)), dim=-1)


def ex_joint_vel(seen: Seen) -> Tensor:
    """Joint speeds (B, J) [rad/s], 0 for ankles, waist roll and waist pitch, as in the public code."""
    speed = seen.state.joint_vel
    columns = [
        torch.zeros_like(speed[:, i]) if any(part in name for part in _UNSEEN) else speed[:, i]
        for i, name in enumerate(joint_names())
    ]
    return torch.stack(columns, dim=-1)


def ex_key_errors(seen: Seen) -> Tensor:
    """Teacher: from the robot's key bodies to the reference's, its root over the robot's (B, 3 K) [m], world axes."""
    return (over_robot(seen.ref, seen.state.root_pos_w).key_pos_w - seen.key_pos_w).flatten(1)


def ex_target_joint_pos(seen: Seen) -> Tensor:
    """The reference's joint angles 0.1 s ahead (B, J) [rad], or one step ahead where nothing further is looked up."""
    return seen.ref.ahead_joint_pos[:, 0] if seen.ref.ahead else seen.ref.joint_pos


def ex_target_lin_vel(seen: Seen) -> Tensor:
    """The reference's velocity in its own base frame (B, 3) [m/s]."""
    return rotate_inverse(seen.ref.root_quat_w, seen.ref.root_lin_vel_w)


def ex_target_attitude(seen: Seen) -> Tensor:
    """The reference's roll and pitch [rad] and height [m], (B, 3)."""
    roll, pitch, _ = roll_pitch_yaw(seen.ref.root_quat_w)
    return torch.stack((roll, pitch, seen.ref.root_pos_w[:, 2]), dim=-1)


def ex_target_keys(seen: Seen) -> Tensor:
    """The reference's key bodies from its own root, in its own base frame (B, 3 K) [m]."""
    ref = seen.ref
    return ((ref.key_pos_w - ref.root_pos_w[:, None]) @ matrix(ref.root_quat_w)).flatten(1)


SIZES = {
    ex_roll_pitch: 2,
    ex_yaw_error: 2,
    ex_joint_vel: None,
    ex_key_errors: _KEYS,
    ex_target_joint_pos: None,
    ex_target_lin_vel: 3,
    ex_target_attitude: 3,
    ex_target_keys: _KEYS,
}
"""Entries of each term; None: one a joint."""

NOISE = {"ex_roll_pitch": 0.1, "ex_joint_vel": 0.075}
"""Largest error of each term, as in the public code (levels times its factor of 0.5)."""
