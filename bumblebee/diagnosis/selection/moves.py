"""The one way a model changes: a candidate comes in, beside or in the place of others, is refitted and judged.

    move = refitted(run.now, rest, candidate, starts, terms)       # all jointly; None unless it is sure
    if move and move.passes():                                      # any of `terms.rules`, and no artefact
        run.take(move)

Additions, swaps and the parts of a friction differ in their terms alone: how the windows weigh, how sure the candidate
must be, which rules of `thresholds.comparison` ask. What goes without anything in its place is
`comparison.backward_elimination`'s.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, effects_at
from bumblebee.diagnosis.comparison import Holdout, compare, is_physical, wald, z_value
from bumblebee.diagnosis.estimation import Fit, cost_of, gauss_newton
from bumblebee.diagnosis.residuals import Problem, window_weights

Now = tuple[Problem, Holdout, Fit]
"""The windows, those to judge by, and the model as it is."""
Certainty = Callable[[Problem, Fit, Fit, np.ndarray], float]
"""z of the last candidate of the second fit, the first is without it, at some weights (W,)."""


def by_slopes(problem: Problem, rest: Fit, new: Fit, weights: np.ndarray) -> float:
    """How many standard errors the last candidate is from its declared value."""
    return wald(problem, new, weights, len(new.chosen) - 1)


def by_loss(problem: Problem, rest: Fit, new: Fit, weights: np.ndarray) -> float:
    """Wald statistic, or if more, the fit's loss without the candidate: slopes miss half of a swing."""
    fall = cost_of(problem, rest.residual, weights)[0] - new.cost
    numbers = int(np.count_nonzero(new.chosen[-1].scales))
    lost = z_value(max(fall, 0.0) / max(new.power(problem), 1.0), numbers, len(weights))
    return max(by_slopes(problem, rest, new, weights), lost)


@dataclass(frozen=True, eq=False)
class Terms:
    """On which terms a candidate comes in."""

    bound: float
    """z that it must reach."""
    rules: tuple[Any, ...]
    """Rules of `thresholds.comparison`; one that is met is enough."""
    iterations: int
    """Steps of the joint refit."""
    weights: np.ndarray | None = None
    """(W,) of the refit and of its z; None: of the refit as the trial leaves the windows."""
    weighed_after: bool = False
    """Whether z has the weights that the refit itself leaves."""
    certainty: Certainty = by_slopes
    held: bool = False
    """Whether the sensitivities of what stays hold wherever it moves: enough for a trial, and far cheaper."""
    artefact: bool = True
    """Whether it must gain more than other integrators and the readings' noise would."""


@dataclass(frozen=True, eq=False)
class Move:
    """A joint refit with one candidate more, the last of its chosen."""

    problem: Problem
    holdout: Holdout
    before: Fit
    """The model as it is."""
    rest: Fit
    """Fit that stays without it."""
    after: Fit
    weights: np.ndarray
    """(W,) that `z` was found with."""
    z: float
    """Statistic of the candidate."""
    terms: Terms

    @property
    def new(self) -> Candidate:
        """Candidate that comes in."""
        return self.after.chosen[-1]

    @property
    def gone(self) -> list[Candidate]:
        """Candidates that it replaces."""
        return [c for c in self.before.chosen if c not in self.after.chosen]

    def passes(self) -> bool:
        """Whether the model with it meets a rule against the model as it is, and it is no artefact."""
        gain = compare(self.problem, self.holdout, self.before, self.after)
        if not any(gain.passes(rule) for rule in self.terms.rules):
            return False
        return not self.terms.artefact or is_physical(self.problem, self.rest, self.after, self.new, self.weights)


def refitted(now: Now, rest: Fit, candidate: Candidate, starts: Sequence[np.ndarray], terms: Terms) -> Move | None:
    """A candidate beside the `rest` of the model as it is, all refitted; None unless it is sure.

    `starts` are values (P,) of all to start from, of which the cheapest refit counts.
    """
    problem, holdout, before = now
    chosen = (*rest.chosen, candidate)
    weights = terms.weights if terms.weights is not None else _as_left(problem, rest, chosen, starts[0])
    held = rest.chosen if terms.held else ()
    fits = [
        gauss_newton(problem, chosen, start, weights, terms.iterations, coarse=True, known=before, held=held)
        for start in starts
    ]
    new = min(fits, key=lambda fit: fit.cost)
    weights = window_weights(new.clean(problem)) if terms.weighed_after else weights
    z = terms.certainty(problem, rest, new, weights)
    return Move(problem, holdout, before, rest, new, weights, z, terms) if z >= terms.bound else None


def _as_left(problem: Problem, rest: Fit, chosen: Sequence[Candidate], start: np.ndarray) -> np.ndarray:
    """Weights (W,) of the windows as the start leaves them: what only the new effect explains weighed little so far."""
    residual = problem.residual([effects_at(chosen, start)])[0]
    return window_weights(residual - np.tensordot(rest.nuisance, problem.nuisance, axes=1))
