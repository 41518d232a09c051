"""The last few rows of each world, in a ring that stays where it is and is written without the host."""

import torch
from torch import Tensor

from bumblebee.tracking.rows import Rows


class History:
    """The last `steps` rows of B worlds.

    Args:
        worlds: B.
        size: entries of a row.
        steps: rows that are kept.
        device: where they are kept.
    """

    def __init__(self, worlds: int, size: int, steps: int, device: torch.device | str = "cpu") -> None:
        self.steps = steps
        self.ring = torch.zeros(worlds, steps, size, device=device)
        """(B, steps, size)."""
        self.oldest = torch.zeros(1, dtype=torch.long, device=device)
        """(1,) place of the oldest row in the ring, which is overwritten next."""
        self._order = torch.arange(steps, device=device)

    def add(self, row: Tensor, fresh: Rows) -> None:
        """Append a row (B, size); in the worlds `fresh` it takes the place of all rows: their past was another's."""
        self.ring.index_copy_(1, self.oldest, row[:, None])
        fresh.put(self.ring, fresh.of(row)[:, None])
        self.oldest.add_(1).remainder_(self.steps)

    def stacked(self) -> Tensor:
        """All rows, the oldest first, (B, steps * size)."""
        return self.ring.index_select(1, (self.oldest + self._order) % self.steps).flatten(1)
