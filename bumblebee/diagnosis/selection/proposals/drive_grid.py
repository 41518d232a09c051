"""One drive's strength, gain or torque limit by factors far from one, where residuals are too large for slopes.

A saturated servo has no slope in its gain, and a limit none in itself: only trying tells. A limit far below what a load
asks for and a motor of a hundredth of its strength both leave a joint limp; only tried side by side does the limit come
first, for the motor would still pull harder where the joint is further off.

Some of the windows tell which few are worth a look; these are simulated on all, and at sizes between. Where a drive
came out far weaker than declared, its limit is tried once more in the place of what was found on the joint, when the
other large effects are known (`limit_swaps`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.comparison import columns_without
from bumblebee.diagnosis.estimation import Fit, LeftOver
from bumblebee.diagnosis.residuals import Problem, screening_windows
from bumblebee.diagnosis.selection.profile import Profile
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.trial import Trial
from bumblebee.diagnosis.thresholds.proposals import DriveGrid

LIMIT = "torque_limit"
WEAK = ("motor_strength", "kp")
KINDS = (*WEAK, LIMIT)


def drive_trials(
    problem: Problem, fit: Fit, candidates: Sequence[Candidate], weights: np.ndarray, large_residual: float
) -> list[Trial]:
    """The drives' parameters of `KINDS` that explain much at one of the factors.

    None where the median chi-square of the windows is below `large_residual`.
    """
    if float(np.median((fit.residual**2).mean(axis=1))) < large_residual:
        return []
    rule = problem.thresholds.selection.proposals.drive_grid
    chosen = {(c.effect, c.where) for c in fit.chosen}
    kinds = {(c.effect, c.where): c for c in candidates if c.effect in KINDS and (c.effect, c.where) not in chosen}
    keep = screening_windows(problem, rule.windows)
    small = replace(fit, residual=fit.residual[keep], columns=fit.columns[:, keep])
    some = _Costs(problem.part(keep), small, weights[keep])
    series = [(c, some.profile(c, _values(c, rule))) for c in kinds.values()]
    worth = [(c, own) for c, own in series if -own.gain < rule.share * some.start]
    every, found = _Costs(problem, fit, weights), []
    for c, own in sorted(worth, key=lambda pair: -pair[1].gain)[: rule.most]:
        best = every.around(c, own.around, rule.halvings if c.effect == LIMIT else 0)
        if best.cost < rule.share * every.start:
            found.append(best)
    return found


def limit_swaps(run: SearchState, free: Sequence[Candidate]) -> Iterator[tuple[Fit, Trial]]:
    """A torque limit in the place of a weak drive, and of all that was found on its joint; what stays of the fit first.

    Args:
        run: the search.
        free: what may go.
    """
    rule = run.problem.thresholds.selection.proposals.drive_grid
    limits = {c.where: c for c in run.candidates if c.effect == LIMIT}
    for weak in (c for c in free if c.effect in WEAK and run.fit.of(c)[0] <= rule.weak and c.where in limits):
        beside = [c for c in free if c.where == weak.where]
        for gone in ([weak], beside) if len(beside) > 1 else ([weak],):
            rest = columns_without(run.problem, run.fit, gone)
            costs, limit = _Costs(run.problem, rest, run.weights), limits[weak.where]
            yield rest, costs.around(limit, costs.profile(limit, _values(limit, rule)).around, rule.halvings)


def _values(c: Candidate, rule: DriveGrid) -> list[float]:
    """Sizes to try, as factors on where the effect is absent."""
    return [f * c.nominal[0] for f in (rule.limits if c.effect == LIMIT else rule.factors)]


class _Costs:
    """Costs of a fit with a parameter at several values, the chosen effects free to move linearly."""

    def __init__(self, problem: Problem, fit: Fit, weights: np.ndarray) -> None:
        self.problem, self.fit, self.beside = problem, fit, LeftOver(problem, fit, weights)
        self.start = self.beside.cost(fit.residual)
        self.declared = problem.residual([fit.effects], coarse=True)[0]

    def profile(self, c: Candidate, values: Sequence[float]) -> Profile[float]:
        """Minus the cost at each value."""
        moved = self.problem.residual([[*self.fit.effects, c.at([v])] for v in values], coarse=True)
        return Profile(values, [-self.beside.cost(self.fit.residual - (self.declared - own)) for own in moved])

    def around(self, c: Candidate, three: tuple[float, float, float], halvings: int) -> Trial:
        """The trial at the best of a value and of some between its neighbours, by geometric means."""
        series = self.profile(c, [three[1]])
        low, _, high = three
        for _ in range(halvings):
            middle = series.size
            between = [float(np.sqrt(low * middle)), float(np.sqrt(middle * high))]
            finer = self.profile(c, between)
            if finer.gain > series.gain:
                low, high = (low, middle) if finer.size == between[0] else (middle, high)
                series = Profile([finer.size], [finer.gain])
            else:
                low, high = between
        moved = self.problem.residual([[*self.fit.effects, c.at([series.size])]], coarse=True)[0]
        return Trial(c, np.array([series.size]), -series.gain, self.beside.left(self.declared - moved))
