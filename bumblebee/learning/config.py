"""Settings of PPO, a section of params.yaml."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class PpoConfig:
    """Proximal policy optimisation; the defaults are for minutes on a CPU, `PAPER` is the paper's (appendix B)."""

    iterations: int = 600
    """Updates in all; each sees `num_worlds` times `steps` control steps."""
    steps: int = 16
    """Control steps of each world before an update."""
    epochs: int = 3
    """Passes over those steps."""
    mini_batches: int = 4
    """Gradient steps a pass."""
    gamma: float = 0.97
    """Discount a control step."""
    lam: float = 0.95
    """Decay of the advantage estimate."""
    clip: float = 0.2
    """Largest change of the action's probability ratio that is rewarded."""
    entropy: float = 0.001
    """Weight of the entropy."""
    value: float = 1.0
    """Weight of the critic's loss."""
    grad_norm: float = 1.0
    """Gradients are scaled down to this norm."""
    schedule: Literal["adaptive", "fixed"] = "adaptive"
    """Adapt the learning rate to the KL divergence of an update, or leave it."""
    learning_rate: float = 1e-3
    """First, or only, learning rate."""
    learning_rate_range: tuple[float, float] = (1e-4, 2e-3)
    """Bounds of the adaptive rate: with 23 actions a small KL target would pin it to nothing."""
    desired_kl: float = 0.05
    """KL divergence of an update that the rate is adapted to, at first."""
    desired_kl_end: float = 0.05
    """The same at the end."""
    hidden: tuple[int, ...] = (256, 256, 128)
    """Widths of the actor's and the critic's layers, ELU."""
    initial_std: float = 0.8
    """First standard deviation of the action; 0.3 was a dead end."""
    symmetry: bool = False
    """Learn from every sample's reflection too, left and right exchanged; doubles the batch."""
    checkpoint_every: int = 25
    """Iterations between checkpoints, from which a killed training goes on."""


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
