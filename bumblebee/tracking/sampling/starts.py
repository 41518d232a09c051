"""Where an episode starts: at a frame of the reference, a little off."""

import torch
from torch import Tensor

from bumblebee.sim.rotations import from_rotation_vector, multiply
from bumblebee.tracking.sampling.library import ReferenceFrame


def start_state(ref: ReferenceFrame, noise: float, generator: torch.Generator) -> tuple[Tensor, Tensor]:
    """Start qpos (n, 7 + J) and qvel (n, 6 + J) at the reference, with uniform noise times `noise`.

    The noise is at most .02 m in the plane, .04 rad about each axis, .03 rad in the joints, and .1 m/s, .2 rad/s and .3
    rad/s in their speeds.
    """
    n, j = ref.joint_pos.shape
    parts = ((3, 0.02), (3, 0.04), (j, 0.03), (3, 0.1), (3, 0.2), (j, 0.3))
    draws = 2 * torch.rand(n * (12 + 2 * j), generator=generator, device=generator.device) - 1
    pieces = draws.split([n * columns for columns, _ in parts])
    off = [noise * size * piece.view(n, columns) for piece, (columns, size) in zip(pieces, parts, strict=True)]
    shift, turn, joints, lin_vel, ang_vel, joint_vel = off
    shift[:, 2] = 0.0  # never into the floor
    quat = multiply(ref.root_quat_w, from_rotation_vector(turn))
    qpos = torch.cat((ref.root_pos_w + shift, quat, ref.joint_pos + joints), dim=-1)
    speeds = (ref.root_lin_vel_w + lin_vel, ref.root_ang_vel_b + ang_vel)
    return qpos, torch.cat((*speeds, ref.joint_vel + joint_vel), dim=-1)
