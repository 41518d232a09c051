"""Some of the worlds, as indices or as a mask: one code for a CPU, which saves work, and a GPU, which avoids syncs."""

import torch
from torch import Tensor


class Rows:
    """The worlds where `mask` (B,) bool is set.

    By indices, work is done for these alone, and their number must be known: a GPU would be waited for. By mask, it is
    done for all B and taken where the mask is set.

    Args:
        mask: (B,) bool.
        by_mask: whether to work by mask.
    """

    def __init__(self, mask: Tensor, by_mask: bool) -> None:
        self.mask = mask
        self.ids = None if by_mask else mask.nonzero()[:, 0]

    def __len__(self) -> int:
        """Number of worlds that work is done for."""
        return len(self.mask if self.ids is None else self.ids)

    @property
    def chosen(self) -> Tensor:
        """Indices or mask, as `Engine.reset` takes them."""
        return self.mask if self.ids is None else self.ids

    def of(self, values: Tensor) -> Tensor:
        """The rows of `values` (B, ...) that work is done for."""
        return values if self.ids is None else values[self.ids]

    def put(self, into: Tensor, values: Tensor | float) -> None:
        """Write `values`, one for each world that work is done for or one for all, into the chosen rows of `into`."""
        if self.ids is not None:
            into[self.ids] = values
            return
        mask = self.mask.view(-1, *[1] * (into.ndim - 1))
        if isinstance(values, Tensor):
            into.copy_(torch.where(mask, values, into))
        else:
            into.masked_fill_(mask, values)
