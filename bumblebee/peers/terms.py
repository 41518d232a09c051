"""The quantities that a peer's policy may see, by the name that its contract file uses.

Names beginning with `reference_` are the motion's, at the control step that the contract says; all others are the
robot's now. Vectors are in the base's own frame, the robot's or the reference's.
"""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from bumblebee.peers.geometry import roll_pitch_yaw
from bumblebee.sim.engine import RobotState
from bumblebee.sim.rotations import rotate_inverse
from bumblebee.tracking.sampling.library import ReferenceFrame


@dataclass(frozen=True)
class Seen:
    """Inputs of a term for B robots; joint values (B, J) are in the contract's order."""

    state: RobotState
    ref: ReferenceFrame
    """The reference at the term's step."""
    last_action: Tensor
    """(B, J) output of the step before, zeros at the first."""
    default_pos: Tensor
    """(J,) [rad]."""


@dataclass(frozen=True)
class TermKind:
    """A term: number of its values, 0 for one a joint, and the function (B, size) of what is seen."""

    size: int
    value: Callable[[Seen], Tensor]


def roll_pitch(quat: Tensor) -> Tensor:
    """Roll and pitch (B, 2) [rad] of orientations (B, 4)."""
    return torch.stack(roll_pitch_yaw(quat)[:2], dim=-1)


def gravity(quat: Tensor) -> Tensor:
    """Direction of gravity (B, 3) in the frame of orientations (B, 4)."""
    down = torch.tensor([0.0, 0.0, -1.0]).expand(len(quat), 3)
    return rotate_inverse(quat, down)


TERMS: dict[str, TermKind] = {
    "base_lin_vel": TermKind(3, lambda seen: seen.state.root_lin_vel_b),
    "base_ang_vel": TermKind(3, lambda seen: seen.state.root_ang_vel_b),
    "base_height": TermKind(1, lambda seen: seen.state.root_pos_w[:, 2:]),
    "roll_pitch": TermKind(2, lambda seen: roll_pitch(seen.state.root_quat_w)),
    "projected_gravity": TermKind(3, lambda seen: gravity(seen.state.root_quat_w)),
    "joint_pos": TermKind(0, lambda seen: seen.state.joint_pos - seen.default_pos),
    "joint_vel": TermKind(0, lambda seen: seen.state.joint_vel),
    "last_action": TermKind(0, lambda seen: seen.last_action),
    "reference_lin_vel": TermKind(3, lambda seen: rotate_inverse(seen.ref.root_quat_w, seen.ref.root_lin_vel_w)),
    "reference_ang_vel": TermKind(3, lambda seen: seen.ref.root_ang_vel_b),
    "reference_height": TermKind(1, lambda seen: seen.ref.root_pos_w[:, 2:]),
    "reference_roll_pitch": TermKind(2, lambda seen: roll_pitch(seen.ref.root_quat_w)),
    "reference_projected_gravity": TermKind(3, lambda seen: gravity(seen.ref.root_quat_w)),
    "reference_joint_pos": TermKind(0, lambda seen: seen.ref.joint_pos),
    "reference_joint_pos_from_default": TermKind(0, lambda seen: seen.ref.joint_pos - seen.default_pos),
    "reference_joint_vel": TermKind(0, lambda seen: seen.ref.joint_vel),
}
"""Name -> term. A term is added here, with a test in tests/peers/test_observer.py and a line in docs/peers.md."""
