"""Settings of the world-model learner, a section of params.yaml."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

from bumblebee.ranges import Factor, Few, PartOf, Positive, Range, Ranged, Rate, Share, Widths
from bumblebee.tracking.config import EnvConfig

_CONTROL_HZ = 50  # of the policy


@dataclass(frozen=True)
class WorldModelConfig(Ranged):
    """Learning through a differentiable model of the robot (Fussell, Bergamin and Holden, SuperTrack, 2021)."""

    iterations: Annotated[int, Range(least=1, most=1_000_000_000)] = 2000
    """Iterations in all: some control steps of all worlds, then updates of both networks."""
    steps: Annotated[int, Range(least=1, most=10000)] = 8
    """Control steps of each world an iteration."""
    memory: Annotated[int, Range(least=2, most=100000)] = 64
    """Last control steps of each world that both networks learn from."""
    window: Annotated[int, Range(least=1, most=1000)] = 24
    """Control steps that the model predicts in a row when it learns."""
    horizon: Annotated[int, Range(least=1, most=1000)] = 24
    """Control steps that the policy imagines in a row when it learns."""
    model_updates: Few = 6
    """Gradient steps of the model an iteration."""
    policy_updates: Few = 6
    """Gradient steps of the policy an iteration."""
    model_batch: Annotated[int, Range(least=1, most=10_000_000)] = 1024
    """Windows of a gradient step of the model."""
    policy_batch: Annotated[int, Range(least=1, most=10_000_000)] = 2048
    """Imagined rollouts of a gradient step of the policy."""
    model_hidden: Widths = (1024, 1024, 1024)
    """Widths of the model's layers, each with layer normalisation and SiLU."""
    hidden: Widths = (1024, 512, 256)
    """Widths of the policy's and the value's layers, ELU."""
    model_rate: Rate = 1e-3
    """Learning rate of the model at first; it falls to a tenth along a cosine."""
    policy_rate: Rate = 5e-4
    """Learning rate of the policy at first; it falls likewise."""
    value_rate: Rate = 1e-3
    """Learning rate at first of the value, which says what comes after the imagined steps; it falls likewise."""
    value_average: Share = 0.99
    """Weight of the past in the average of the value's weights, which its targets and the policy see."""
    trace: Share = 0.95
    """Lambda of TD(lambda): weight of later imagined rewards against the next value in what the value learns."""
    gamma: PartOf = 0.97
    """Discount a control step."""
    grad_norm: Positive = 1.0
    """Gradients are scaled down to this norm."""
    average: Share = 0.995
    """Weight of the past in the average of the policy's weights, which is what is tried and exported."""
    noise: Factor = 0.08
    """Standard deviation of the exploration, in units of the action; worlds have from none to twice as much."""
    warm_up: Annotated[int, Range(least=1, most=1_000_000)] = 200
    """Gradient steps of the model before the policy's first."""
    symmetry: bool = False
    """Learn from every motion's reflection too, left and right exchanged."""
    compile: bool = False
    """Whether torch compiles a control step of model and task, minutes once; it needs a C compiler on the machine."""
    checkpoint_every: Annotated[int, Range(least=1, most=1_000_000_000)] = 50
    """Iterations between checkpoints, from which a killed training goes on."""

    def __post_init__(self) -> None:
        """Refuse windows that the memory cannot hold."""
        super().__post_init__()
        self.require(self.window < self.memory, "window", "fewer steps than `memory`")

    def misfits(self, task: EnvConfig, longest: float = math.inf) -> Iterator[tuple[str, str, object]]:
        """Settings of a training that this learner cannot take: which, what was expected and what came.

        Args:
            task: its task.
            longest: control steps of the longest motion, where it is known.
        """
        if (history := task.observation.history) > 1:
            yield "env.observation.history", "1 with the learner `world_model`, which imagines no history", history
        if task.num_worlds < 2:
            yield "env.num_worlds", "at least 2 with the learner `world_model`, which holds one out", task.num_worlds
        steps = int(min(round(task.episode_seconds * _CONTROL_HZ), longest))
        for name in ("window", "horizon"):
            if (came := getattr(self, name)) > steps:
                yield f"world_model.{name}", f"at most {steps} control steps, the longest episode", came
