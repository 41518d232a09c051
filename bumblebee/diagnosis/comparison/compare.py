"""Is B better than A? One comparison of two fits, and one rule for each place that asks.

    compare(problem, holdout, before, after).passes(problem.thresholds.comparison.validation)

The rules differ in what they are asked of: an effect that is added (`Validation`, or `WhereFelt` and `WhereRare` for
what few windows feel), many at once (`Together`), a swap (`WindowByWindow`, `NoWorseOnAverage`, `NoWorseWithinErrors`),
a law of which another may be as good (`NotRefuted`).
Each is a frozen dataclass with its numbers in `thresholds/comparison.py`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from bumblebee.diagnosis.comparison.holdout import Holdout
from bumblebee.diagnosis.comparison.information_criterion import criterion, parameters
from bumblebee.diagnosis.comparison.paired_tests import falls, logs, margin, there
from bumblebee.diagnosis.comparison.submodel import simulated_without
from bumblebee.diagnosis.estimation import Fit, cost_of
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.diagnosis.thresholds.comparison import (
    NotRefuted,
    NoWorseOnAverage,
    NoWorseWithinErrors,
    Together,
    Validation,
    WhereFelt,
    WhereRare,
    WindowByWindow,
)

Pair = tuple[np.ndarray, np.ndarray]
"""Residuals (W, M) of both fits less their nuisances, on the same windows."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """Two fits of the same windows; the validation windows took part in neither."""

    problem: Problem
    """With the fitted windows."""
    holdout: Holdout
    before: Fit
    after: Fit

    @cached_property
    def fitted(self) -> Pair:
        """On the fitted windows."""
        return self.before.clean(self.problem), self.after.clean(self.problem)

    @cached_property
    def validation(self) -> Pair | None:
        """On the validation windows; None where nothing is held out."""
        if self.holdout.problem is None:
            return None
        old, new = self.holdout.left([self.before, self.after])
        return old, new

    @cached_property
    def gain(self) -> np.ndarray:
        """(W,) fall of log(1 + chi-square) of the validation windows, or of the fitted where there are none."""
        old, new = self.validation or self.fitted
        return logs(old) - logs(new)

    @cached_property
    def worse_later(self) -> bool:
        """Whether joint positions are further off after 1 s."""
        return self.holdout.worse_later(self.before, self.after)

    def passes(self, rule: Any) -> bool:
        """Whether `after` meets a rule of `thresholds.comparison`."""
        return _JUDGES[type(rule)](self, rule)


def compare(problem: Problem, holdout: Holdout, before: Fit, after: Fit) -> Comparison:
    """`after` against `before`; simulated only as far as a rule asks."""
    return Comparison(problem, holdout, before, after)


def _validation(c: Comparison, rule: Validation) -> bool:
    """Whether what `after` changes is there in the validation windows, too, and not a trifle; and no worse after 1 s.

    The residual of `before` is compared with the change that `after` predicts there, and with nothing else: in a robot
    of many joints an effect of one is a small share of the whole chi-square, and none of its noise. `after` must gain
    its share of what it and all effects before it gain together: where one law stands for a slightly different one, the
    rest is significant, too. A part of what is left is enough: of a robot far from its model, a hundredth of what a
    drive of half the strength explains is more than all friction. So is most of what is left above the noise.
    """
    if c.validation is None:
        return True
    problem = c.holdout.judge
    old, new = c.validation
    weights = window_weights(new)
    bare = problem.residual([[]])[0]
    bare = bare - np.tensordot(cost_of(problem, bare, weights)[1], problem.nuisance, axes=1)
    powers = [float((weights[:, None] * r**2).sum()) for r in (bare, old, new)]
    noise = float(weights.sum()) * new.shape[1]
    excess = max(rule.of_excess * (powers[1] - noise), rule.of_noise * noise)
    if powers[1] - powers[2] < min(rule.least_share * (powers[0] - powers[2]), rule.of_rest * powers[1], excess):
        return False
    if not (there(old, new, weights, rule.z) or falls(old, new, rule.z, rule.rank_windows)):
        return False
    return not c.worse_later


def _where_felt(c: Comparison, rule: WhereFelt) -> bool:
    """Fitted and validation windows alike, each for itself."""
    sides = [c.fitted, *([c.validation] if c.validation else [])]
    gains = np.concatenate([logs(old) - logs(new) for old, new in sides])
    felt = gains[np.abs(gains) > rule.felt]
    better = int((felt > 0).sum())
    return better >= max(rule.least, 1) and better >= rule.nearly * len(felt) and float(felt.sum()) > rule.clear


def _where_rare(c: Comparison, rule: WhereRare) -> bool:
    if c.validation is None:
        return False
    change, seen = (((old - new) ** 2).sum(axis=1).mean() for old, new in (c.fitted, c.validation))
    return not seen > rule.unfelt * change and _where_felt(c, rule.felt)


def _together(c: Comparison, rule: Together) -> bool:
    """Without validation windows the fitted ones decide, by their cost."""
    if c.validation is None:
        weights = window_weights(c.after.clean(c.problem))
        old, new = (cost_of(c.problem, fit.residual, weights)[0] for fit in (c.before, c.after))
        return new < (1.0 - rule.fall) * old
    doubt = rule.z * c.gain.std() / np.sqrt(len(c.gain))
    return bool(c.gain.mean() > max(rule.fall, doubt)) and not c.worse_later


def _window_by_window(c: Comparison, rule: WindowByWindow) -> bool:
    """By `z` standard errors on the validation windows.

    With fewer numbers, which fitted windows flatter less, more on those and the fitted ones together do as well, if the
    validation windows are no worse. With many fewer, a better fit of both will do: several catalogue effects that are
    near a law need not be far from it.
    """
    fewer = parameters(c.before) - parameters(c.after)
    if fewer < 0 or criterion(c.problem, c.after) <= criterion(c.problem, c.before):
        return False
    sure = c.gain.mean() > margin(c.gain, rule.z)
    if fewer and not sure and c.gain.mean() > 0 and c.validation is not None:
        fitted = np.subtract(*(logs(side) for side in c.fitted))
        both = np.concatenate((c.gain, fitted))
        sure = both.mean() > margin(both, rule.z_with_fitted) or (fewer >= rule.many_fewer and fitted.mean() > 0)
    return bool(sure) and not c.worse_later


def _no_worse_within_errors(c: Comparison, rule: NoWorseWithinErrors) -> bool:
    if c.after.cost < c.before.cost:
        return True
    if c.validation is not None:
        loss = logs(c.validation[1]) - logs(c.validation[0])
    else:  # the rival's own nuisances are not known: both have those of `before`
        raw = c.problem.residual([c.before.effects, c.after.effects])
        old, new = logs(raw - np.tensordot(c.before.nuisance, c.problem.nuisance, axes=1))
        loss = new - old
    return bool(loss.mean() < rule.z * loss.std(ddof=1) / np.sqrt(len(loss)))


def _not_refuted(c: Comparison, rule: NotRefuted) -> bool:
    """Beyond `z` standard errors, on fitted and validation windows together: the fits have as many numbers."""
    sides = [c.fitted, *([c.validation] if c.validation else [])]
    loss = np.concatenate([logs(new) - logs(old) for old, new in sides])
    return bool(loss.mean() < margin(loss, rule.z))


def _no_worse_on_average(c: Comparison, rule: NoWorseOnAverage) -> bool:
    if c.validation is None:
        return True
    old, new = (logs(side) for side in c.validation)
    return bool(new.mean() <= old.mean()) and not c.worse_later


_JUDGES: dict[type, Callable[[Comparison, Any], bool]] = {
    Validation: _validation,
    WhereFelt: _where_felt,
    WhereRare: _where_rare,
    Together: _together,
    WindowByWindow: _window_by_window,
    NoWorseWithinErrors: _no_worse_within_errors,
    NotRefuted: _not_refuted,
    NoWorseOnAverage: _no_worse_on_average,
}


def lead(problem: Problem, holdout: Holdout, form: Fit, named: Fit) -> float:
    """Share of what a basis function gains that catalogue effects do not; 0 unless it is better beyond doubt.

    Window by window on those that took no part in the fits, on the fitted ones where there are none, from the fit of
    what both have. Effects that need more numbers than the function must be the better ones, for enough of them come
    near anything.
    """
    common = simulated_without(problem, form, [c for c in form.chosen if c not in named.chosen])
    left = _logs(problem, holdout, [common, named, form])
    gain, whole = left[1] - left[2], left[0] - left[2]
    z = problem.thresholds.comparison.window_by_window.z
    error = 0.0 if parameters(named) > parameters(form) else margin(gain, z)
    return float(gain.mean() / max(whole.mean(), gain.mean())) if gain.mean() > error else 0.0


def _logs(problem: Problem, holdout: Holdout, fits: Sequence[Fit]) -> np.ndarray:
    """log(1 + chi-square) (F, W) of the validation windows, of the fitted ones where there are none."""
    if holdout.problem is not None:
        return logs(holdout.left(fits))
    return np.stack([logs(f.clean(problem)) for f in fits])
