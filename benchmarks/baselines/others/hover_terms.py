"""HOVER's command: everything that could be tracked, each part masked by a control mode, and the mask itself.

A mode says which points, joints and parts of the root a robot is to follow; what it is not to follow is 0 in the
command, and the mask tells a 0 from nothing. HOVER draws a mode at an episode's start. Here world i keeps mode i modulo
the number of modes: at any time each mode has the same share of the worlds, as with theirs.
"""

from functools import cache

import torch
from torch import Tensor

from benchmarks.baselines.others.h2o_terms import POINTS, h2o_joint_errors, h2o_target_points_h
from bumblebee.peers.geometry import roll_pitch_yaw, wrapped
from bumblebee.robot.facts import KEY_BODIES, joint_names
from bumblebee.sim.rotations import rotate_inverse
from bumblebee.tracking.observing.terms import Seen

ROOT = ("velocity_x", "velocity_y", "velocity_z", "roll", "pitch", "yaw", "height")
"""Parts of the root's command."""
_POINTS = (*KEY_BODIES, "head")
_JOINTS = joint_names()
ELEMENTS = (
    *(f"point_{name}" for name in _POINTS),
    *(f"joint_{name}" for name in _JOINTS),
    *(f"root_{name}" for name in ROOT),
)
"""Elements of a mask in order; a point has one element and three numbers of the command."""

_ARM = ("shoulder", "elbow")
_UPPER_JOINTS = tuple(f"joint_{name}" for name in _JOINTS if any(part in name for part in ("waist", *_ARM)))
_WHOLE_ROOT = tuple(f"root_{name}" for name in ROOT)
_HANDS = ("point_left_wrist_yaw_link", "point_right_wrist_yaw_link")
MODES: dict[str, tuple[str, ...]] = {
    "exbody": (*_UPPER_JOINTS, *_WHOLE_ROOT),
    "humanplus": (*(f"joint_{name}" for name in _JOINTS), *_WHOLE_ROOT),
    "h2o": (*(f"point_{name}" for name in KEY_BODIES if any(part in name for part in (*_ARM, "wrist", "ankle"))),),
    "omnih2o": (*_HANDS, "point_head"),
    "all": ELEMENTS,
}
"""The public code's four modes with what each follows, and all of it at once, which is what policies are tried with."""


def hover_command(seen: Seen) -> Tensor:
    """The masked command (B, 3 P + J + 7) of each world's mode."""
    return _masked(seen, _mask_of(seen))


def hover_mask(seen: Seen) -> Tensor:
    """The mask (B, P + J + 7) of each world's mode: 1 where it is to follow."""
    return _mask_of(seen)


def hover_command_all(seen: Seen) -> Tensor:
    """The whole command (B, 3 P + J + 7), nothing masked."""
    return whole_command(seen)


def hover_mask_all(seen: Seen) -> Tensor:
    """The mask (B, P + J + 7) of mode `all`: ones."""
    return torch.ones(len(seen.last_action), len(ELEMENTS), device=seen.last_action.device)


def whole_command(seen: Seen) -> Tensor:
    """Points [m] from the root in the heading frame, joints' errors [rad], and the root's part, (B, 3 P + J + 7)."""
    return torch.cat((h2o_target_points_h(seen), h2o_joint_errors(seen), root_command(seen)), dim=-1)


def root_command(seen: Seen) -> Tensor:
    """(B, 7): the reference's velocity in its own base frame [m/s], roll, pitch, error of the yaw [rad], height [m]."""
    ref = seen.ref
    roll, pitch, yaw = roll_pitch_yaw(ref.root_quat_w)
    turn = wrapped(yaw - roll_pitch_yaw(seen.state.root_quat_w)[2])
    velocity = rotate_inverse(ref.root_quat_w, ref.root_lin_vel_w)
    return torch.cat((velocity, torch.stack((roll, pitch, turn, ref.root_pos_w[:, 2]), dim=-1)), dim=-1)


def mode_table(modes: tuple[str, ...] = tuple(MODES)) -> Tensor:
    """Masks (M, P + J + 7) of the modes."""
    return torch.tensor([[float(name in MODES[mode]) for name in ELEMENTS] for mode in modes])


def spread(mask: Tensor) -> Tensor:
    """A mask (B, P + J + 7) as factors on the command (B, 3 P + J + 7)."""
    points = mask[:, :POINTS].repeat_interleave(3, dim=-1, output_size=3 * POINTS)
    return torch.cat((points, mask[:, POINTS:]), dim=-1)


SIZES = {
    hover_command: 3 * POINTS + len(_JOINTS) + len(ROOT),
    hover_mask: len(ELEMENTS),
    hover_command_all: 3 * POINTS + len(_JOINTS) + len(ROOT),
    hover_mask_all: len(ELEMENTS),
}
"""Entries of each term."""


def _masked(seen: Seen, mask: Tensor) -> Tensor:
    return whole_command(seen) * spread(mask)


def _mask_of(seen: Seen) -> Tensor:
    worlds, device = len(seen.last_action), seen.last_action.device
    table = _table_on(str(device))
    return table[torch.arange(worlds, device=device) % len(table)]


@cache
def _table_on(device: str) -> Tensor:
    return mode_table().to(device)
