"""A candidate tried in the simulator at the size that its test suggests."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, naming_order, rough
from bumblebee.diagnosis.estimation import Fit, LeftOver
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.thresholds.selection import Trials


@dataclass(frozen=True, eq=False)
class Trial:
    """One candidate at one size."""

    candidate: Candidate
    values: np.ndarray
    """(P,) parameters."""
    cost: float
    """Cost of the fit with it, the chosen ones free to move linearly."""
    change: np.ndarray
    """(W, M) what it does to the prediction, beside what the chosen ones could."""


def try_one(problem: Problem, fit: Fit, candidate: Candidate, steps: np.ndarray, weights: np.ndarray) -> Trial | None:
    """Secant steps along the suggested direction `steps` (F,) of the free parameters; None where nothing changes.

    The change is simulated in coarse steps and added to the fit's own residual, which is of fine ones.
    """
    beside = LeftOver(problem, fit, weights)
    coarse = rough([candidate.effect, *(e.effect for e in fit.effects)])
    declared = problem.residual([fit.effects], coarse=coarse)[0]
    before = beside.left(fit.residual)
    free = list(candidate.free)
    nominal = np.array(candidate.nominal)
    values = candidate.start
    values[free] = nominal[free] + np.asarray(steps) * np.array(candidate.step)[free]
    values = candidate.clip(values)
    best: Trial | None = None
    for _ in range(problem.thresholds.selection.trials.secants):
        raw = declared - problem.residual([[*fit.effects, candidate.at(values)]], coarse=coarse)[0]
        raw = problem.tamed(raw) if coarse else raw
        change = beside.left(raw)
        cost = beside.cost(fit.residual - raw)
        if best is None or cost < best.cost:
            best = Trial(candidate, values, cost, change)
        size = (weights[:, None] * change**2).sum()
        if size < 1e-9:
            return None
        factor = float(np.clip((weights[:, None] * change * before).sum() / size, 0.1, 4.0))
        new = values.copy()
        new[free] = nominal[free] + factor * (values - nominal)[free]
        new = candidate.clip(new)
        scale = np.abs(np.array(candidate.step))[free]
        if (np.abs(new - values)[free] < 0.03 * np.maximum(np.abs(values - nominal)[free], scale)).all():
            break
        values = new
    return best


def simplest(tried: Sequence[Trial], before: float, rule: Trials) -> Trial:
    """Simplest of the trials that cost nearly the same as the best: the usual effect, or the fewest parameters.

    Costs that differ by a few say nothing; those of changes that are nearly parallel differ by more than that only
    because their sizes were found in coarse steps. `before` is the cost without any of them.
    """
    best = min(tried, key=lambda t: t.cost + 2 * len(t.candidate.free))

    def near(t: Trial) -> bool:
        worse = t.cost + 2 * len(t.candidate.free) - best.cost - 2 * len(best.candidate.free)
        product = (t.change * best.change).sum()
        parallel = product > rule.parallel * np.linalg.norm(t.change) * np.linalg.norm(best.change)
        return worse < rule.alike or bool(parallel and worse < rule.share * (before - best.cost))

    def rank(t: Trial) -> tuple[int, int, float]:
        return (naming_order(t.candidate.effect), len(t.candidate.free), t.cost)

    return min((t for t in tried if near(t)), key=rank)
