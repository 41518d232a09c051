"""One block of a Gated Transformer-XL: attention over the last few steps, a feed-forward layer, a gate behind each.

Dai et al. 2019, "Transformer-XL" (1901.02860), section 3.3, has the attention by relative position; Parisotto et al.
2019, "Stabilizing Transformers for Reinforcement Learning" (1910.06764), section 3.2, the order of norms and the gates.
Every query sees the `memory` steps before its own, and its own: relative positions are the same for all queries.
"""

from collections.abc import Sequence

import torch
from torch import Tensor, nn


class GruGate(nn.Module):
    """Gate that lets a sub-layer's output y into what went past it, x: g(x, y), a GRU's step.

    r = s(W_r y + U_r x), z = s(W_z y + U_z x - b), h = tanh(W_g y + U_g (r x)), g = (1 - z) x + z h, with s the
    logistic function. With b above 0 the gate lets x through at first, and the block begins near the identity.

    Args:
        size: entries of x and y.
        bias: b at the start; it is learnt.
    """

    def __init__(self, size: int, bias: float) -> None:
        super().__init__()
        self.of_new = nn.Linear(size, 3 * size, bias=False)
        """W_r, W_z, W_g, one under the other."""
        self.of_old = nn.Linear(size, 2 * size, bias=False)
        """U_r, U_z."""
        self.of_kept = nn.Linear(size, size, bias=False)
        """U_g."""
        self.bias = nn.Parameter(torch.full((size,), bias))

    def forward(self, old: Tensor, new: Tensor) -> Tensor:
        """g(old, new), (..., E) each."""
        new_r, new_z, new_g = self.of_new(new).chunk(3, dim=-1)
        old_r, old_z = self.of_old(old).chunk(2, dim=-1)
        keep, update = torch.sigmoid(new_r + old_r), torch.sigmoid(new_z + old_z - self.bias)
        return (1.0 - update) * old + update * torch.tanh(new_g + self.of_kept(keep * old))


class WindowAttention(nn.Module):
    """Attention of each step over itself and the `memory` steps before it.

    The score of a query q for a key k that lies d steps back is (q + u) k + (q + v) W_R R_d, over the square root of a
    head's size; R_d holds sines and cosines of d.

    Args:
        size: entries E of a step.
        heads: H, of E / H entries each.
        memory: M, steps before its own that a step sees.
    """

    def __init__(self, size: int, heads: int, memory: int) -> None:
        super().__init__()
        self.heads, self.memory, self._head = heads, memory, size // heads
        self.query, self.key, self.value, self.place, self.out = (nn.Linear(size, size, bias=False) for _ in range(5))
        self.content_bias, self.place_bias = (nn.Parameter(torch.zeros(heads, self._head)) for _ in range(2))
        self.register_buffer("distances", sinusoids(range(memory, -1, -1), size), persistent=False)

    def forward(self, steps: Tensor, known: Tensor) -> Tensor:
        """Attend from the last S steps, (N, S, E).

        Args:
            steps: (N, M + S, E), the oldest first.
            known: (N, M + S) bool, which of them belong to the episode; the last S must.
        """
        reach = self.memory + 1
        query = self._split(self.query(steps[:, self.memory :]))
        key, value = (self._split(layer(steps)).unfold(1, reach, 1) for layer in (self.key, self.value))
        place = self._split(self.place(self.distances))
        score = torch.einsum("nshd,nshdm->nshm", query + self.content_bias, key)
        score = score + torch.einsum("nshd,mhd->nshm", query + self.place_bias, place)
        score = score / self._head**0.5
        unseen = ~known.unfold(1, reach, 1)[:, :, None]
        weight = score.masked_fill(unseen, -torch.inf).softmax(dim=-1)
        return self.out(torch.einsum("nshm,nshdm->nshd", weight, value).flatten(-2))

    def _split(self, values: Tensor) -> Tensor:
        """(..., E) by heads, (..., H, E / H)."""
        return values.unflatten(-1, (self.heads, self._head))


class GatedBlock(nn.Module):
    """A block: norm, attention, gate; norm, feed-forward, gate.

    Args:
        size: entries E of a step.
        heads: of the attention.
        memory: steps before its own that a step sees.
        feed_forward: units of the feed-forward layer.
        gate_bias: see `GruGate`.
    """

    def __init__(self, size: int, heads: int, memory: int, feed_forward: int, gate_bias: float) -> None:
        super().__init__()
        self.attention = WindowAttention(size, heads, memory)
        self.before_attention, self.before_forward = nn.LayerNorm(size), nn.LayerNorm(size)
        self.widen, self.narrow = nn.Linear(size, feed_forward), nn.Linear(feed_forward, size)
        self.after_attention, self.after_forward = (GruGate(size, gate_bias) for _ in range(2))

    def forward(self, steps: Tensor, known: Tensor) -> Tensor:
        """(N, S, E) of the last S steps; arguments as of `WindowAttention`."""
        seen = self.attention(self.before_attention(steps), known)
        value = self.after_attention(steps[:, self.attention.memory :], torch.relu(seen))
        made = self.narrow(torch.relu(self.widen(self.before_forward(value))))
        return self.after_forward(value, torch.relu(made))


def sinusoids(distances: Sequence[int], size: int) -> Tensor:
    """R (D, E): sines and cosines of each distance times 10000^(-2 i / E), sines first."""
    rates = 10_000.0 ** (-torch.arange(0, size, 2, dtype=torch.float64) / size)
    angles = torch.tensor(list(distances), dtype=torch.float64)[:, None] * rates
    return torch.cat((angles.sin(), angles.cos()), dim=-1).float()
