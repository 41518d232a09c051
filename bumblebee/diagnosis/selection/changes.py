"""Changes that a step of the search may ask for: it reads the state, and `steps.go` alone changes it.

A step is a generator. It yields one change after the other, goes on when each was made, is told whether the model is
another one now, and returns what it has found:

    def add(run):
        accepted = yield Offered(candidate, values)
        return accepted
"""

from collections.abc import Generator
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.comparison import Holdout
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.moves import Move
from bumblebee.sim.effects import Effect


@dataclass(frozen=True, eq=False)
class Loss:
    """Commands that were lost on all joints at once or on one."""

    where: str
    """Joint, "" for all at once."""
    share: float
    ci95: tuple[float, float]
    gain: float
    """Log-likelihood on the fitted windows, of this share against none."""
    paid: float
    """Loss on the validation windows; infinite where there are none."""
    explains: float
    """Share of the held-out excess of chi-square that goes with the commands that arrived."""

    @property
    def effect(self) -> Effect:
        """As a value; without a place it is the whole robot's."""
        return Effect("dropped_commands", (self.where,) if self.where else (), {"share": self.share})


@dataclass(frozen=True, eq=False)
class Offered:
    """An addition, still to be judged."""

    candidate: Candidate
    values: np.ndarray
    """(P,) from a trial."""


@dataclass(frozen=True, eq=False)
class Taken:
    """An addition or a swap that was judged; its p is shared among the `rivals`, all candidates if None."""

    move: Move
    rivals: int | None = None
    reopens: bool = False
    """Whether what was refused before may be tried again."""


@dataclass(frozen=True, eq=False)
class Refitted:
    """Another fit of what is there, or of a part of it."""

    fit: Fit
    said: str
    pruned: bool = False
    """Whether what has become needless with it goes, too."""


@dataclass(frozen=True, eq=False)
class Renamed:
    """A fit that is as good under other names."""

    fit: Fit


@dataclass(frozen=True, eq=False)
class Anew:
    """Anew that were whitened around a fit, to begin anew with; `begun`: with many effects at once."""

    problem: Problem
    holdout: Holdout
    fit: Fit
    begun: bool = False


@dataclass(frozen=True, eq=False)
class Lost:
    """Commands that never arrived, and windows with those that did."""

    loss: Loss
    problem: Problem
    holdout: Holdout
    fit: Fit


@dataclass(frozen=True)
class Vain:
    """An effect on a joint that was tried in vain, or is tried but once."""

    effect: str
    where: str


@dataclass(frozen=True)
class Asked:
    """All joints at once were asked; `far`: of a robot far from the data, before anything is found."""

    far: bool


@dataclass(frozen=True)
class Expecting:
    """So many effects may come at once before the step ends."""

    effects: int


Change = Expecting | Offered | Taken | Refitted | Renamed | Anew | Lost | Vain | Asked
T = TypeVar("T")
Asking = Generator[Change, bool, T]
"""A step that returns a T."""
