"""Which clip, from which frame: long clips and those that fail are drawn more often, none ever vanishes."""

import torch
from torch import Tensor

_LAST_START = 25  # frames: an episode has at least this many left, if the clip is that long


class ClipSampler:
    """Draws by length times (floor + failure rate); a clip that was never tried counts as failing.

    Args:
        length: (N,) frames of each clip.
        floor: share of the weight that success cannot take away.
        memory: share of the failure rate that one more episode leaves.
        start_share: share of the draws that start at frame 0.
        share: (N,) optional factor on each clip's weight.
    """

    def __init__(
        self,
        length: Tensor,
        floor: float = 0.3,
        memory: float = 0.9,
        start_share: float = 0.2,
        share: Tensor | None = None,
    ) -> None:
        self.floor, self.memory, self.start_share = floor, memory, start_share
        self.length = length
        self.share = torch.ones_like(length, dtype=torch.float32) if share is None else share.to(length.device)
        self.failure = torch.ones_like(self.share)

    def probabilities(self) -> Tensor:
        """Chance of each clip, (N,)."""
        weight = self.length * self.share * (self.floor + self.failure)
        return weight / weight.sum()

    def draw(self, n: int, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        """Clips (n,) and frames (n,) to start from."""
        device = self.length.device
        # The first clip whose share of the line from 0 to 1 ends beyond the number drawn.
        ends = torch.cumsum(self.probabilities(), 0)
        place = torch.rand(n, generator=generator, device=device) * ends[-1]
        clip = torch.searchsorted(ends, place, right=True).clamp(max=len(ends) - 1)
        room = (self.length[clip] - _LAST_START).clamp(min=1)
        frame = (torch.rand(n, generator=generator, device=device) * room).long()
        from_start = torch.rand(n, generator=generator, device=device) < self.start_share
        return clip, torch.where(from_start, torch.zeros_like(frame), frame)

    def update(self, clip: Tensor, failed: Tensor, ended: Tensor | None = None) -> None:
        """Count ended episodes: clips (n,), whether each failed (n,) bool and, if not all did, ended (n,) bool."""
        if len(clip) == 0:
            return
        counted = torch.ones_like(clip, dtype=torch.float32) if ended is None else ended.float()
        zeros = torch.zeros_like(self.failure)
        count = zeros.index_add(0, clip, counted)
        fails = zeros.index_add(0, clip, failed.float() * counted)
        keep = self.memory**count
        self.failure.copy_(keep * self.failure + (1 - keep) * fails / count.clamp(min=1))
