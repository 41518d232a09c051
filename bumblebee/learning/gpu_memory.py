"""The least memory of a GPU that a training needs, known before it begins: tensors that it keeps, or holds in updates.

Counted are tensors whose sizes follow from the settings. The simulator's own memory, which is taken before, the CUDA
context, compiled code, workspaces and what torch keeps aside come on top, so that a training may need more than this.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import torch

from bumblebee.errors import BadInput
from bumblebee.learning.config import PpoConfig

FLOAT, LONG, BOOL = 4, 8, 1  # bytes


@dataclass(frozen=True)
class Needs:
    """Bytes of a training's tensors, by the setting that they grow with."""

    kept: Mapping[str, int]
    """Tensors that are there throughout."""
    passing: Mapping[str, int] = field(default_factory=dict)
    """Tensors that single updates hold for their gradients, one after another."""

    @property
    def least(self) -> int:
        """Bytes that are needed at the same time [B]."""
        return sum(self.kept.values()) + max(self.passing.values(), default=0)

    @property
    def largest(self) -> str:
        """The setting that most bytes grow with."""
        every = {**self.kept, **self.passing}
        return max(every, key=every.__getitem__)

    def line(self, robots: int, free: int, total: int) -> str:
        """Need of a training of so many `robots` beside what the card has [B], in words.

        Raises:
            BadInput: if that does not fit into what is `free`.
        """
        gb = 1e9
        has = f"{free / gb:.1f} of its {total / gb:.1f} GB"
        if self.least > free:
            part = {**self.kept, **self.passing}[self.largest] / gb
            do = f"Lower `{self.largest}`, which takes {part:.1f} GB."
            wanted = f"at least {self.least / gb:.1f} GB at {robots} robots, beside the simulator"
            raise BadInput("free memory of the GPU", wanted, has, do)
        return f"needs at least {self.least / gb:.1f} GB of GPU memory at {robots} robots; the card has {has} free"


def weights(sizes: Sequence[int]) -> int:
    """Numbers in the weights of linear layers between layers of these sizes."""
    return sum((before + 1) * after for before, after in pairwise(sizes))


def ppo_needs(config: PpoConfig, robots: int, groups: Mapping[str, int], joints: int) -> Needs:
    """PPO's steps of all robots, two networks with their optimiser, and what a mini-batch leaves for its gradients.

    Args:
        config: the algorithm.
        robots: how many there are on this GPU.
        groups: sizes of the observations, of "policy" and "critic" among them.
        joints: J.
    """
    each = FLOAT * (sum(groups.values()) + 3 * joints + 5) + BOOL  # actions and their mean and spread; 5 numbers
    batch = config.steps * robots // config.mini_batches * (2 if config.symmetry else 1)
    ends = ((groups["policy"], joints), (groups["critic"], 1))
    layers = sum(weights((first, *config.hidden, last)) for first, last in ends)
    inner = 2 * sum(config.hidden)  # of each network: before and after ELU
    held = FLOAT * batch * sum(first + inner for first, _ in ends)
    return Needs({"env.num_worlds": config.steps * robots * each + held, "ppo.hidden": 4 * FLOAT * layers})


def told(needs: Needs, robots: int, device: torch.device, say: bool) -> None:
    """Say in one line what a training on a GPU needs, if it is to `say` so; on a CPU nothing.

    Raises:
        BadInput: if it does not fit into the GPU's free memory.
    """
    if device.type != "cuda":
        return
    free, total = torch.cuda.mem_get_info(device)
    aside = torch.cuda.memory_reserved(device) - torch.cuda.memory_allocated(device)  # torch's, of trainings before
    line = needs.line(robots, free + aside, total)
    if say:
        print(line, flush=True)
