"""Settings of PPO, a section of params.yaml."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal

from bumblebee.ranges import Factor, Few, Positive, Range, Ranged, Rate, Share, Widths
from bumblebee.tracking.config import EnvConfig


@dataclass(frozen=True)
class PpoConfig(Ranged):
    """Proximal policy optimisation; the defaults are for minutes on a CPU, `PAPER` is the paper's (appendix B)."""

    iterations: Annotated[int, Range(least=1, most=1_000_000_000)] = 600
    """Updates in all; each sees `num_worlds` times `steps` control steps."""
    steps: Annotated[int, Range(least=1, most=10000)] = 16
    """Control steps of each world before an update."""
    epochs: Few = 3
    """Passes over those steps."""
    mini_batches: Annotated[int, Range(least=1, most=10000)] = 4
    """Gradient steps a pass."""
    gamma: Share = 0.97
    """Discount a control step."""
    lam: Share = 0.95
    """Decay of the advantage estimate."""
    clip: Annotated[float, Range(above=0, most=10)] = 0.2
    """Largest change of the action's probability ratio that is rewarded."""
    entropy: Factor = 0.001
    """Weight of the entropy."""
    value: Factor = 1.0
    """Weight of the critic's loss."""
    grad_norm: Positive = 1.0
    """Gradients are scaled down to this norm."""
    schedule: Literal["adaptive", "fixed"] = "adaptive"
    """Adapt the learning rate to the KL divergence of an update, or leave it."""
    learning_rate: Rate = 1e-3
    """First, or only, learning rate."""
    learning_rate_range: tuple[Rate, Rate] = (1e-4, 2e-3)
    """Bounds of the adaptive rate: with 23 actions a small KL target would pin it to nothing."""
    desired_kl: Positive = 0.05
    """KL divergence of an update that the rate is adapted to, at first."""
    desired_kl_end: Positive = 0.05
    """KL divergence that the rate is adapted to at the end."""
    hidden: Widths = (256, 256, 128)
    """Widths of the actor's and the critic's layers, ELU."""
    initial_std: Positive = 0.8
    """First standard deviation of the action; 0.3 was a dead end."""
    value_first: Annotated[int, Range(least=0, most=1_000_000)] = 0
    """First iterations in which the value alone learns, for a policy that comes without a critic or to another task."""
    symmetry: bool = False
    """Learn from every sample's reflection too, left and right exchanged; doubles the batch."""
    captured: bool | None = None
    """Update without waiting for the GPU, each gradient step one CUDA graph; None: on one GPU."""
    checkpoint_every: Annotated[int, Range(least=1, most=1_000_000_000)] = 25
    """Iterations between checkpoints, from which a killed training goes on."""

    def __post_init__(self) -> None:
        """Refuse bounds that run backwards."""
        super().__post_init__()
        self.require_order("learning_rate_range")

    def misfits(self, task: EnvConfig) -> Iterator[tuple[str, str, object]]:
        """Settings of a training that this learner cannot take: which, what was expected and what came."""
        least = math.ceil(max(self.mini_batches, 2) / task.num_worlds)
        if self.steps < least:
            yield "ppo.steps", f"at least {least} for {self.mini_batches} mini-batches of all worlds' steps", self.steps


PAPER = PpoConfig(
    steps=24,
    epochs=5,
    gamma=0.99,
    schedule="fixed",
    learning_rate=1e-4,
    hidden=(1024, 1024, 512),
    initial_std=1.0,
)
"""Appendix B: Adam 1e-4 fixed, 5 epochs of 4 mini-batches, gamma 0.99, clip 0.2, entropy 0.001, MLP 1024-1024-512."""
