"""Which stretch of which clip to start in: what is lost more often, and what leads up to it; none ever vanishes.

`ClipSampler` gives a long clip with one hard second and a hard clip the same weight a frame. Here clips are cut into
stretches of equal length, and the failure rate is each stretch's own: of the robots that entered it, the share that was
lost in it.
"""

import torch
from torch import Tensor

from bumblebee.tracking.sampling.sampler import Chances, ClipSampler, ClipShares


class StretchSampler:
    """Draws a stretch by its frames times (floor + the mean failure rate of it and the next one of its clip).

    Args:
        length: (N,) frames of each clip.
        stretch: frames of a stretch; a clip's last one may be shorter.
        floor: share of the weight that success cannot take away.
        memory: share of a stretch's failure rate that one more robot leaves.
        start_share: share of the draws that start at frame 0 of the stretch's clip.
        shares: of the draws, of groups of clips, within which the above holds; None: one group.
    """

    def __init__(
        self,
        length: Tensor,
        stretch: int,
        floor: float = 0.3,
        memory: float = 0.98,
        start_share: float = 0.2,
        shares: ClipShares | None = None,
    ) -> None:
        self.stretch, self.floor, self.memory, self.start_share = stretch, floor, memory, start_share
        device = length.device
        count = (length + stretch - 1) // stretch
        self.first = torch.cumsum(count, 0) - count
        """(N,) index of each clip's first stretch."""
        self.clip = torch.repeat_interleave(torch.arange(len(length), device=device), count)
        """(S,) the clip of each stretch."""
        self.start = (torch.arange(len(self.clip), device=device) - self.first[self.clip]) * stretch
        """(S,) first frame of each stretch."""
        self.frames = torch.minimum(length[self.clip] - self.start, torch.full_like(self.start, stretch))
        """(S,) frames of each stretch."""
        self._next = torch.arange(len(self.clip), device=device)
        self._next[:-1] += (self.clip[1:] == self.clip[:-1]).long()
        self._chances = Chances(None if shares is None else shares.of(self.clip), device)
        self.failure = torch.ones_like(self.clip, dtype=torch.float32)
        """(S,) failure rate of each stretch; 1 for what was never tried."""

    def probabilities(self) -> Tensor:
        """Chance of each stretch, (S,)."""
        hard = 0.5 * (self.failure + self.failure[self._next])
        return self._chances(self.frames * (self.floor + hard))

    def draw(self, n: int, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        """Clips (n,) and frames (n,) to start from."""
        device = self.failure.device
        ends = torch.cumsum(self.probabilities(), 0)
        place = torch.rand(n, generator=generator, device=device) * ends[-1]
        drawn = torch.searchsorted(ends, place, right=True).clamp(max=len(ends) - 1)
        within = (torch.rand(n, generator=generator, device=device) * self.frames[drawn]).long()
        from_start = torch.rand(n, generator=generator, device=device) < self.start_share
        frame = torch.where(from_start, torch.zeros_like(within), self.start[drawn] + within)
        return self.clip[drawn], frame

    def follow(self, clip: Tensor, frame: Tensor, lost: Tensor, done: Tensor) -> None:
        """Take in a control step of all worlds: clip and frame (B,), which were lost, whose episode ended.

        A world counts for a stretch when it is lost in it, or leaves it, or comes to its clip's end.
        """
        at = self.first[clip] + frame // self.stretch
        at = torch.minimum(at, torch.full_like(at, len(self.failure) - 1))
        passed = (frame + 1 == self.start[at] + self.frames[at]) & ~done
        counted = (lost | passed | (done & ~lost & (frame + 2 >= self.start[at] + self.frames[at]))).float()
        zeros = torch.zeros_like(self.failure)
        count = zeros.index_add(0, at, counted)
        fails = zeros.index_add(0, at, lost.float())
        keep = self.memory**count
        self.failure.copy_(keep * self.failure + (1 - keep) * fails / count.clamp(min=1))


def sampler_of(
    length: Tensor, stretch: int, floor: float, memory: float, start_share: float, shares: ClipShares | None
) -> ClipSampler | StretchSampler:
    """A sampler of stretches of so many frames; with 0 frames, of clips. Arguments as of `StretchSampler`."""
    drawing = (floor, memory, start_share, shares)
    return StretchSampler(length, stretch, *drawing) if stretch else ClipSampler(length, *drawing)
