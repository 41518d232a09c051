"""All motions of a library, packed into tensors, so that a batch of robots can look up a frame each at once."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import torch
from torch import Tensor

if TYPE_CHECKING:
    from bumblebee.motion.clip import Clip

AHEAD = (0.1, 0.3)
"""Default look-ahead of the observation [s] after frame t+1."""


@dataclass(frozen=True)
class ReferenceFrame:
    """One frame of the reference for each of B robots.

    `root_pos_w` (B, 3), `root_quat_w` (B, 4) wxyz, `root_lin_vel_w` (B, 3), `root_ang_vel_b` (B, 3), `joint_pos`
    (B, J), `joint_vel` (B, J), `key_pos_w` (B, 14, 3), `lead` (B, J) [rad] of the gravity feed-forward, and A frames
    further ahead: `ahead_root_pos_w` (B, A, 3), `ahead_root_quat_w` (B, A, 4), `ahead_joint_pos` (B, A, J).
    """

    root_pos_w: Tensor
    root_quat_w: Tensor
    root_lin_vel_w: Tensor
    root_ang_vel_b: Tensor
    joint_pos: Tensor
    joint_vel: Tensor
    key_pos_w: Tensor
    lead: Tensor
    ahead_root_pos_w: Tensor
    ahead_root_quat_w: Tensor
    ahead_joint_pos: Tensor

    @property
    def hold_pos(self) -> Tensor:
        """Servo targets (B, J) [rad] that carry the reference pose: what an action of zero commands."""
        return self.joint_pos + self.lead

    @property
    def ahead(self) -> int:
        """Number of frames further ahead."""
        return self.ahead_root_pos_w.shape[1]


def over_robot(ref: ReferenceFrame, root_pos_w: Tensor) -> ReferenceFrame:
    """The reference moved in the plane until its root stands over the robot's (B, 3) [m], at its own height.

    What is compared with it is compared in the robot's own place: drift of the place in the world is forgiven.
    """
    shift = root_pos_w - ref.root_pos_w
    flat = torch.cat((shift[:, :2], torch.zeros_like(shift[:, 2:])), dim=-1)
    places = {"root_pos_w": ref.root_pos_w + flat, "key_pos_w": ref.key_pos_w + flat[:, None]}
    return replace(ref, **places, ahead_root_pos_w=ref.ahead_root_pos_w + flat[:, None])


class MotionLibrary:
    """Clips, resampled to one rate, as rows of one tensor; a lookup beyond a clip's end gives its last frame at rest.

    Args:
        clips: at least one; all at the same fps.
        ahead: look-ahead times [s] of the frames further ahead.
        feed_forward: whether `lead` is computed; zeros otherwise.
        device: where the rows are kept, 500 bytes a frame: 8,179 motions of 8 s take 1.6 GB.
    """

    def __init__(
        self,
        clips: "Sequence[Clip]",
        ahead: Sequence[float] = AHEAD,
        feed_forward: bool = True,
        device: torch.device | str = "cpu",
    ) -> None:
        from bumblebee.motion.clip import velocities
        from bumblebee.tracking.feed_forward import lead_angles

        self.clips = list(clips)
        self.names = [clip.name for clip in self.clips]
        self.fps = float(self.clips[0].fps)
        assert all(clip.fps == self.fps for clip in self.clips), "clips of one library share one rate"
        self.ahead = tuple(ahead)
        lengths = [clip.frames for clip in self.clips]
        self.length = torch.tensor(lengths, device=device)  # (N,) frames
        self.start = torch.cumsum(self.length, 0) - self.length
        self.num_joints = self.clips[0].joint_pos.shape[1]
        rows = []
        for clip in self.clips:
            speed = velocities(clip)
            flat = clip.key_pos.reshape(clip.frames, -1)
            columns = (
                clip.root_pos,
                clip.root_quat,
                clip.joint_pos,
                flat,
                lead_angles(clip) if feed_forward else clip.joint_pos * 0,
                speed.root_lin_vel_w,
                speed.root_ang_vel_b,
                speed.joint_vel,
            )
            rows.append(torch.cat([torch.as_tensor(c, dtype=torch.float32) for c in columns], dim=1))
        self._rows = torch.cat(rows).to(device)
        self._moving = self._rows.shape[1] - (3 + 3 + self.num_joints)  # first column of the velocities
        self._offsets = torch.tensor([0.0, *self.ahead], device=device)

    def __len__(self) -> int:
        """Number of clips."""
        return len(self.clips)

    def frames(self, ids: Tensor, time: Tensor) -> ReferenceFrame:
        """The reference of clip ids (B,) at `time` (B,) [s], interpolated between frames."""
        last = (self.length[ids] - 1)[:, None]
        wanted = (time[:, None] + self._offsets) * self.fps  # (B, 1 + A)
        position = torch.minimum(wanted.clamp(min=0), last)
        # A time that is a whole frame up to rounding must give that frame, not 0.9999 of it.
        nearest = position.round()
        position = torch.where((position - nearest).abs() < 1e-3, nearest, position)
        low = position.floor().long()
        weight = (position - low)[..., None]
        first = self.start[ids][:, None] + low
        row = self._at(first)
        # On a CPU a look saves the blending, which whole frames do not need; on a GPU it would stop the device.
        if row.is_cuda or bool((weight > 0).any()):
            after = self._at(self.start[ids][:, None] + torch.minimum(low + 1, last))
            row = _blend(row, after, weight)
        row[:, 0, self._moving :] *= wanted[:, :1] <= last  # frames further ahead have no velocities
        return self._unpack(row)

    def _at(self, rows: Tensor) -> Tensor:
        """Rows (B, A, columns) by their indices (B, A)."""
        return self._rows.index_select(0, rows.flatten()).unflatten(0, rows.shape)

    def _unpack(self, row: Tensor) -> ReferenceFrame:
        j, keys = self.num_joints, self.clips[0].key_pos.shape[1]
        sizes = (3, 4, j, 3 * keys, j, 3, 3, j)
        root_pos, root_quat, joint_pos, key_pos, lead, lin_vel, ang_vel, joint_vel = row.split(sizes, dim=-1)
        return ReferenceFrame(
            root_pos_w=root_pos[:, 0],
            root_quat_w=root_quat[:, 0],
            root_lin_vel_w=lin_vel[:, 0],
            root_ang_vel_b=ang_vel[:, 0],
            joint_pos=joint_pos[:, 0],
            joint_vel=joint_vel[:, 0],
            key_pos_w=key_pos[:, 0].unflatten(-1, (keys, 3)),
            lead=lead[:, 0],
            ahead_root_pos_w=root_pos[:, 1:],
            ahead_root_quat_w=root_quat[:, 1:],
            ahead_joint_pos=joint_pos[:, 1:],
        )


def _blend(a: Tensor, b: Tensor, weight: Tensor) -> Tensor:
    """Linear between two rows; the quaternion by the shorter way, renormalised."""
    row = torch.lerp(a, b, weight)
    qa, qb = a[..., 3:7], b[..., 3:7]
    qb = torch.where((qa * qb).sum(-1, keepdim=True) < 0, -qb, qb)
    row[..., 3:7] = torch.nn.functional.normalize(torch.lerp(qa, qb, weight), dim=-1)
    return row
