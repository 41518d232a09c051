"""Reference frames that also say how fast the key bodies move, which our own observations and rewards do not use."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import torch
from torch import Tensor

from bumblebee.motion.clip import Clip, differences
from bumblebee.tracking.sampling.library import AHEAD, MotionLibrary, ReferenceFrame


@dataclass(frozen=True)
class MovingFrame(ReferenceFrame):
    """A reference frame with `key_vel_w` (B, 14, 3) [m/s] of the key bodies in the world."""

    key_vel_w: Tensor


def key_vel_w(ref: ReferenceFrame) -> Tensor:
    """Velocities (B, 14, 3) [m/s] of the reference's key bodies; the frame must come from a `MovingLibrary`."""
    assert isinstance(ref, MovingFrame), "these rows and terms need frames of baselines.library.MovingLibrary"
    return ref.key_vel_w


class MovingLibrary(MotionLibrary):
    """A motion library whose frames are `MovingFrame`s; 168 bytes more a frame.

    Args:
        clips: see `MotionLibrary`.
        ahead: see `MotionLibrary`.
        feed_forward: see `MotionLibrary`.
        device: see `MotionLibrary`.
    """

    def __init__(
        self,
        clips: Sequence[Clip],
        ahead: Sequence[float] = AHEAD,
        feed_forward: bool = True,
        device: torch.device | str = "cpu",
    ) -> None:
        super().__init__(clips, ahead, feed_forward, device)
        speeds = [torch.as_tensor(differences(clip.key_pos, clip.fps)) for clip in self.clips]
        self._key_vel = torch.cat(speeds).to(device)

    def frames(self, ids: Tensor, time: Tensor) -> MovingFrame:
        """The reference of clip ids (B,) at `time` (B,) [s]; velocities are those of the nearest frame, 0 at rest."""
        ref = super().frames(ids, time)
        wanted = (time * self.fps).round().long()
        last = self.length[ids] - 1
        speed = self._key_vel[self.start[ids] + torch.minimum(wanted.clamp(min=0), last)]
        speed = speed * (wanted <= last)[:, None, None]
        return MovingFrame(**{item.name: getattr(ref, item.name) for item in fields(ref)}, key_vel_w=speed)
