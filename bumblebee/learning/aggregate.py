"""The data set that DAgger aggregates: what was seen, step by step, with the experts' answers, in a ring of fixed size.

A student with a history, or with a memory, sees many steps at once, and each step is seen many times. So a row is kept
once, in the order of time, with the age of its world's episode; observations and what a memory was made of are put
together when they are drawn. A memory itself is not kept: it would be what weights of long ago made of those steps.
"""

import torch
from torch import Tensor

from bumblebee.errors import BadInput

_BYTES, _GIB = 4, 2**30


class Aggregate:
    """A ring of the last control steps of B worlds; all draws and writes stay on the device.

    Args:
        capacity: samples that are kept, rounded down to whole steps of all worlds.
        worlds: B.
        sizes: entries of one step of an observation, of what is seen of the newest step alone, and of an action.
        history: H, control steps in an observation.
        memory: M, control steps before it that a student remembers; 0 for one without memory.
        device: where all lies.
    """

    def __init__(
        self,
        capacity: int,
        worlds: int,
        sizes: tuple[int, int, int],
        history: int = 1,
        memory: int = 0,
        device: torch.device | str = "cpu",
    ) -> None:
        seen, alone, actions = sizes
        self.history, self.memory, self._seen = history, memory, seen
        self.steps = max(capacity // worlds, 1)
        context = history + memory - 1
        if self.steps <= context:
            wanted = f"at least {(context + 1) * worlds:,}: {context + 1} steps of {worlds} worlds"
            raise BadInput("capacity", wanted, f"{capacity:,}", "The student looks so far back.")
        self.worlds, self._context, self._device = worlds, context, device
        try:
            self._row = torch.zeros(self.steps, worlds, seen + alone, device=device)
            self._mean, self._std = (torch.zeros(self.steps, worlds, actions, device=device) for _ in range(2))
            self._age = torch.zeros(self.steps, worlds, dtype=torch.int32, device=device)
        except torch.OutOfMemoryError:
            came = f"{self.gib(capacity, sizes):.1f} GiB on {device}"
            raise BadInput("capacity", "a memory of samples that the device holds", came, "Keep fewer.") from None
        self._added = 0

    @staticmethod
    def gib(capacity: int, sizes: tuple[int, int, int]) -> float:
        """Memory of so many samples [GiB]: rows, means and deviations of the experts, ages."""
        return capacity * _BYTES * (sizes[0] + sizes[1] + 2 * sizes[2] + 1) / _GIB

    @property
    def size(self) -> int:
        """Samples that are kept."""
        return min(self._added, self.steps) * self.worlds

    def add(self, observation: Tensor, mean: Tensor, std: Tensor, age: Tensor) -> None:
        """Append a control step of all worlds; beyond the capacity the oldest is overwritten.

        Args:
            observation: (B, H * D + N) as a group shows it; its end is the newest step.
            mean: (B, J) what the experts would do there, `std` (B, J) how sharply.
            std: see `mean`.
            age: (B,) control steps since the episode's first.
        """
        place = self._added % self.steps
        start = (self.history - 1) * self._seen
        self._row[place], self._age[place] = observation[:, start:], age
        self._mean[place], self._std[place] = mean, std
        self._added += 1

    def draw(self, count: int, generator: torch.Generator) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Draw `count` samples, with replacement, among those whose past is kept.

        Returns:
            observations (n, M + 1, H * D + N) of the steps that are remembered and of the sample itself, the oldest
            first; which of them belong to its episode (n, M + 1) bool; the experts' mean and deviation (n, J).
        """
        oldest = max(self._added - self.steps, 0)
        first = oldest + (self._context if oldest else 0)
        drawn = torch.randint((self._added - first) * self.worlds, (count,), generator=generator, device=self._device)
        time, world = first + drawn // self.worlds, drawn % self.worlds
        place = time % self.steps
        age = torch.minimum(self._age[place, world], time)  # what was before the first sample is not known
        back = torch.arange(self.memory, -1, -1, device=self._device)
        known = back <= age[:, None]
        return self._observed(time, world, age, back), known, self._mean[place, world], self._std[place, world]

    def _observed(self, time: Tensor, world: Tensor, age: Tensor, back: Tensor) -> Tensor:
        """What `world` (n,) saw `back` (M + 1,) steps before `time` (n,), (n, M + 1, H * D + N).

        As the environment's history has it, what was before an episode's first step is that step.
        """
        older = torch.arange(self.history - 1, -1, -1, device=self._device)
        ago = torch.minimum(back[:, None] + older, age[:, None, None])
        rows = self._row[(time[:, None, None] - ago) % self.steps, world[:, None, None]]
        return torch.cat((rows[..., : self._seen].flatten(2), rows[:, :, -1, self._seen :]), dim=-1)
