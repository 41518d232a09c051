"""Settings of the distillation, a section of params.yaml, and the paper's."""

from dataclasses import dataclass, field
from typing import Annotated, Literal

from bumblebee.learning.generalist.transformer import TransformerConfig
from bumblebee.ranges import Count, Few, Positive, Range, Ranged, Rate, Seed, Share, Widths
from bumblebee.tracking.config import EnvConfig


@dataclass(frozen=True)
class DistillConfig(Ranged):
    """Distillation of the experts into the generalist."""

    iterations: Count = 300
    """Rounds of collecting and learning."""
    steps: Annotated[int, Range(least=1, most=10000)] = 8
    """Control steps of each world a round; with 512 worlds that is the paper's batch of 4096."""
    epochs: Few = 2
    """Passes over a round's number of samples, drawn from all that was gathered."""
    mini_batches: Annotated[int, Range(least=1, most=10000)] = 4
    """Gradient steps a pass."""
    learning_rate: Rate = 5e-4
    """Adam's rate; the paper's is 1e-4 with many more samples."""
    grad_norm: Positive = 1.0
    """Gradients are scaled down to this norm."""
    capacity: Annotated[int, Range(least=1, most=100000000)] = 400_000
    """Samples that are kept; the oldest go first. A million of the paper's student take 0.6 GiB."""
    expert_share: Share = 0.5
    """Share of the worlds in which the expert acts at first; falls to 0 over the first half."""
    init: Literal["base", "scratch"] = "base"
    """Start from the base policy or from nothing; a student with an observation of its own starts from nothing."""
    model: Literal["mlp", "transformer"] = "mlp"
    """Network of the generalist; a transformer starts from scratch."""
    hidden: Widths = (256, 256, 128)
    """Layers of an MLP from scratch; from base they are base's."""
    transformer: TransformerConfig = field(default_factory=TransformerConfig)
    """The transformer, where `model` asks for one."""
    checkpoint_every: Count = 50
    """Iterations between two checkpoints."""
    seed: Seed = 0
    """Seed of the draws and of the network."""
    env: EnvConfig = field(default_factory=EnvConfig)
    """The environment it learns in."""

    def __post_init__(self) -> None:
        """Refuse a store that does not hold one step of all worlds, and batches smaller than their parts."""
        super().__post_init__()
        worlds = self.env.num_worlds
        scratch = self.model == "mlp" or self.init == "scratch"
        self.require(scratch, "init", "scratch for a transformer, since base is an MLP")
        self.require(self.capacity >= worlds, "capacity", f"at least env.num_worlds, {worlds}")
        self.require(worlds * self.steps >= self.mini_batches, "mini_batches", f"at most {worlds * self.steps} samples")


PAPER_DAGGER = DistillConfig(
    steps=1, learning_rate=1e-4, init="scratch", hidden=(1024, 1024, 512), checkpoint_every=1000
)
"""Appendix B, "Hyperparameters for DAgger": Adam 1e-4, batch 4096 (a step of 4096 worlds), 2 epochs of 4 mini-batches,
gradient norm 1; the paper's MLP."""
