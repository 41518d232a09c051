"""Which clip, from which frame: long clips and those that fail are drawn more often, none ever vanishes."""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

_LAST_START = 25  # frames: an episode has at least this many left, if the clip is that long


@dataclass(frozen=True)
class ClipShares:
    """Groups of clips, each with a share of the draws that holds whatever fails; failure decides within a group.

    A group without a clip leaves its share to the others.
    """

    group: Tensor
    """(N,) index of each clip's group."""
    share: Tensor
    """(G,) share of each group's draws, of any sum."""

    @classmethod
    def equal(cls, group: Sequence[int]) -> "ClipShares":
        """Shares with one equal part for each group; `group` is the index of each clip's."""
        index = torch.as_tensor(group)
        return cls(index, torch.ones(int(index.max()) + 1))

    def of(self, clip: Tensor) -> "ClipShares":
        """Shares of what is drawn in place of clips: S parts, each of a clip (S,)."""
        return ClipShares(self.group.to(clip.device)[clip], self.share.to(clip.device))


class Chances:
    """From weights of what is drawn to its chances.

    Args:
        shares: of the groups; None: one group of all.
        device: where the weights are.
    """

    def __init__(self, shares: ClipShares | None, device: torch.device | str) -> None:
        self._member = self._share = None
        if shares is not None:
            groups = torch.arange(len(shares.share))[:, None]
            self._member = (shares.group.cpu() == groups).float().to(device)  # (G, N)
            self._share = shares.share.float().to(device)

    def __call__(self, weight: Tensor) -> Tensor:
        """Chance of each (N,), by its weight (N,), positive, within its group."""
        if self._member is None or self._share is None:
            return weight / weight.sum()
        own = self._member * weight
        total = own.sum(1, keepdim=True).clamp(min=torch.finfo(own.dtype).tiny)
        held = (own / total * self._share[:, None]).sum(0)
        return held / held.sum()


class ClipSampler:
    """Draws by length times (floor + failure rate); a clip that was never tried counts as failing.

    Args:
        length: (N,) frames of each clip.
        floor: share of the weight that success cannot take away.
        memory: share of the failure rate that one more episode leaves.
        start_share: share of the draws that start at frame 0.
        shares: of the draws, of groups of clips, within which the above holds; None: one group.
    """

    def __init__(
        self,
        length: Tensor,
        floor: float = 0.3,
        memory: float = 0.9,
        start_share: float = 0.2,
        shares: ClipShares | None = None,
    ) -> None:
        self.floor, self.memory, self.start_share = floor, memory, start_share
        self.length = length
        self.failure = torch.ones_like(length, dtype=torch.float32)
        self._chances = Chances(shares, length.device)

    def probabilities(self) -> Tensor:
        """Chance of each clip, (N,)."""
        return self._chances(self.length * (self.floor + self.failure))

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
