"""A reward of many weighted rows that may look back, in the manner of legged_gym: times the control period, clipped."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from benchmarks.baselines.others.memory import Memory, Now
from bumblebee.sim.engine import RobotState
from bumblebee.tracking.rewards import Step
from bumblebee.tracking.sampling.library import ReferenceFrame

_MEAN_OF = 10_000  # ended episodes that the mean length remembers


@dataclass(frozen=True)
class Judged:
    """Inputs of a row: the step, what the steps before it left, and which worlds (B,) bool it loses."""

    step: Step
    now: Now
    lost: Tensor

    @property
    def state(self) -> RobotState:
        """The robots after the step."""
        return self.step.state

    @property
    def ref(self) -> ReferenceFrame:
        """The reference of the same moment."""
        return self.step.ref


Row = Callable[[Judged], Tensor]
"""A step's worth (B,), before its weight."""


@dataclass(frozen=True)
class Curriculum:
    """A factor on the rows that punish: it grows while episodes last, and shrinks while they end early."""

    start: float = 0.5
    """First factor."""
    least: float = 0.0
    """Smallest factor."""
    short: float = 50.0
    """Mean episode [control steps] below which it shrinks."""
    long: float = 120.0
    """Mean episode [control steps] above which it grows."""
    degree: float = 1e-5
    """Relative change a control step."""
    rows: tuple[str, ...] = ()
    """Rows that it scales."""


@dataclass(frozen=True)
class Scoring:
    """A reward: its rows, their weights, and how the sum is treated."""

    rows: Mapping[str, Row]
    weights: Mapping[str, float]
    curriculum: Curriculum | None = None
    lowest: float | None = None
    """A step is worth no less than this, after the control period is multiplied in."""

    def __post_init__(self) -> None:
        if set(self.rows) != set(self.weights):
            raise ValueError(f"rows without weight or weights without row: {set(self.rows) ^ set(self.weights)}")


class Score:
    """`Scoring` of B worlds, step by step, on buffers that stay where they are.

    Args:
        scoring: rows and weights.
        dt: control period [s].
        lengths: (B,) control steps of each world's episode so far, kept up to date by the environment; 1 at the first.
        lost: which worlds (B,) bool a state and a reference lose.
    """

    def __init__(
        self,
        scoring: Scoring,
        dt: float,
        lengths: Tensor,
        lost: Callable[[RobotState, ReferenceFrame], Tensor],
    ) -> None:
        self.scoring, self.dt, self.lost = scoring, dt, lost
        self._lengths = lengths
        self._before = torch.zeros_like(lengths)
        self.memory = Memory(len(lengths), dt, lengths.device)
        start = 1.0 if scoring.curriculum is None else scoring.curriculum.start
        self.factor = torch.full((), start, device=lengths.device)
        """() factor on the punishing rows."""
        self.mean_length = torch.zeros((), device=lengths.device)
        """() mean length of the episodes that ended lately [control steps]."""

    def __call__(self, step: Step) -> Tensor:
        """The reward of the step, (B,)."""
        fresh = self._lengths <= 1
        now = self.memory.update(step.state.key_pos_w, step.foot_force_w, fresh)
        judged = Judged(step, now, self.lost(step.state, step.ref))
        self._follow(fresh)
        total = self.dt * torch.stack(list(self.terms(judged).values())).sum(0)
        return total if self.scoring.lowest is None else total.clamp(min=self.scoring.lowest)

    def terms(self, judged: Judged) -> dict[str, Tensor]:
        """Each row with its weight and the curriculum's factor, (B,)."""
        curriculum = self.scoring.curriculum
        scaled = () if curriculum is None else curriculum.rows
        out = {}
        for name, row in self.scoring.rows.items():
            value = self.scoring.weights[name] * row(judged)
            out[name] = value * self.factor if name in scaled else value
        return out

    def kept(self) -> dict[str, Tensor]:
        """All that the next step depends on, for a checkpoint."""
        own = {"before": self._before, "factor": self.factor, "mean_length": self.mean_length}
        return own | self.memory.kept()

    def _follow(self, fresh: Tensor) -> None:
        """Take in the lengths of the episodes that ended before this step, and move the factor."""
        ended = (self._before * fresh).float()
        count = (ended > 0).sum().clamp(max=_MEAN_OF)
        mean = ended.sum() / count.clamp(min=1)
        self.mean_length += (mean - self.mean_length) * count / _MEAN_OF
        self._before.copy_(self._lengths)
        c = self.scoring.curriculum
        if c is None:
            return
        grown = (self.mean_length > c.long).float() - (self.mean_length < c.short).float()
        self.factor.mul_(1 + c.degree * grown).clamp_(c.least, 1.0)
