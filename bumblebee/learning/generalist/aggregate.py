"""The data set that DAgger aggregates: what was seen, step by step, with the experts' answers, in a ring of fixed size.

A student with a history, or with a memory, sees many steps at once, and each step is seen many times. So a row is kept
once, in the order of time, with the age of its world's episode; observations and what a memory was made of are put
together when they are drawn. A memory itself is not kept: it would be what weights of long ago made of those steps.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from bumblebee.errors import BadInput

_BYTES, _GIB = 4, 2**30


@dataclass(frozen=True)
class Samples:
    """N samples that were drawn."""

    observation: Tensor
    """(N, M + 1, H * D + A) of the steps that are remembered and of the sample itself, the oldest first."""
    known: Tensor
    """(N, M + 1) bool, which of them belong to the sample's episode."""
    mean: Tensor
    """(N, J) what the expert would do."""
    std: Tensor
    """(N, J) how sharply."""
    weight: Tensor
    """(N,) what each counts, 1 on average: with it every cluster counts the same, however many samples it has."""


class Aggregate:
    """A ring of the last control steps of B worlds; all draws and writes stay on the device.

    Args:
        capacity: samples that are kept, rounded down to whole steps of all worlds.
        worlds: B.
        sizes: entries of one step of an observation, of what is seen of the newest step alone, and of an action.
        past: H, control steps in an observation, and M, those before it that a student remembers.
        clusters: K.
        device: where all lies.
    """

    def __init__(
        self,
        capacity: int,
        worlds: int,
        sizes: tuple[int, int, int],
        past: tuple[int, int] = (1, 0),
        clusters: int = 1,
        device: torch.device | str = "cpu",
    ) -> None:
        seen, alone, actions = sizes
        (self.history, self.memory), self._seen = past, seen
        self.steps = max(capacity // worlds, 1)
        context = self.history + self.memory - 1
        if self.steps <= context:
            wanted = f"at least {(context + 1) * worlds:,}: {context + 1} steps of {worlds} worlds"
            raise BadInput("capacity", wanted, f"{capacity:,}", "The student looks so far back.")
        self.worlds, self._context, self._device = worlds, context, device
        try:
            self._row = torch.zeros(self.steps, worlds, seen + alone, device=device)
            self._mean, self._std = (torch.zeros(self.steps, worlds, actions, device=device) for _ in range(2))
            self._age, self._cluster = torch.zeros(2, self.steps, worlds, dtype=torch.int32, device=device)
        except torch.OutOfMemoryError:
            came = f"{self.gib(capacity, sizes):.1f} GiB on {device}"
            raise BadInput("capacity", "a memory of samples that the device holds", came, "Keep fewer.") from None
        self.counts = torch.zeros(clusters, dtype=torch.long, device=device)
        """(K,) samples of each cluster."""
        self._added = 0

    @staticmethod
    def gib(capacity: int, sizes: tuple[int, int, int]) -> float:
        """Memory of so many samples [GiB]: rows, means and deviations of the experts, ages, clusters."""
        return capacity * _BYTES * (sizes[0] + sizes[1] + 2 * sizes[2] + 2) / _GIB

    @property
    def size(self) -> int:
        """Samples that are kept."""
        return min(self._added, self.steps) * self.worlds

    def add(self, observation: Tensor, answer: tuple[Tensor, Tensor], age: Tensor, cluster: Tensor) -> None:
        """Append a control step of all worlds; beyond the capacity the oldest is overwritten.

        Args:
            observation: (B, H * D + A) as a group shows it; its end is the newest step.
            answer: (B, J) each, what the experts would do there and how sharply.
            age: (B,) control steps since the episode's first.
            cluster: (B,) index of the cluster of each world's motion.
        """
        place = self._added % self.steps
        start = (self.history - 1) * self._seen
        each = torch.ones(self.worlds, dtype=torch.long, device=self._device)
        if self._added >= self.steps:
            self.counts.index_add_(0, self._cluster[place], -each)
        self.counts.index_add_(0, cluster, each)
        self._row[place], self._age[place], self._cluster[place] = observation[:, start:], age, cluster
        self._mean[place], self._std[place] = answer
        self._added += 1

    def draw(self, count: int, generator: torch.Generator) -> Samples:
        """Draw `count` samples, with replacement, among those whose past is kept."""
        oldest = max(self._added - self.steps, 0)
        first = oldest + (self._context if oldest else 0)
        drawn = torch.randint((self._added - first) * self.worlds, (count,), generator=generator, device=self._device)
        time, world = first + drawn // self.worlds, drawn % self.worlds
        place = time % self.steps
        age = torch.minimum(self._age[place, world], time)  # what was before the first sample is not known
        back = torch.arange(self.memory, -1, -1, device=self._device)
        known = back <= age[:, None]
        own = self.counts[self._cluster[place, world]]
        weight = self.counts.sum() / (own * (self.counts > 0).sum())
        answer = self._mean[place, world], self._std[place, world]
        return Samples(self._observed(time, world, age, back), known, *answer, weight)

    def _observed(self, time: Tensor, world: Tensor, age: Tensor, back: Tensor) -> Tensor:
        """Observations and actions of `world` (n,) `back` (M + 1,) steps before `time` (n,), (n, M + 1, H * D + A).

        As the environment's history has it, what was before an episode's first step is that step.
        """
        older = torch.arange(self.history - 1, -1, -1, device=self._device)
        ago = torch.minimum(back[:, None] + older, age[:, None, None])
        rows = self._row[(time[:, None, None] - ago) % self.steps, world[:, None, None]]
        if rows.shape[-1] == self._seen:
            return rows.flatten(2)
        return torch.cat((rows[..., : self._seen].flatten(2), rows[:, :, -1, self._seen :]), dim=-1)
