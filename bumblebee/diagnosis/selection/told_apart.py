"""Whether the data tell an effect from another of nearly the same sensitivity: both fitted, simulated and compared.

Sensitivities that agree to 0.99 leave a fiftieth of the chi-square, which is plenty where an effect is plain. So a
rival is fitted in the effect's place, beside all else that was found. It is told apart if it is worse on fitted and
validation windows together, by its chi-square and from window to window, and if what sets the two apart is more than
another integrator would do: viscous friction and a servo's damping at one gain differ by how a step treats them, and
by that alone.
"""

from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.comparison import Holdout, compare
from bumblebee.diagnosis.estimation import Fit, LeftOver, explained_share, gauss_newton
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.diagnosis.selection.trial import Trial


def told_apart(problem: Problem, holdout: Holdout, fit: Fit, rest: Fit, trial: Trial, weights: np.ndarray) -> bool:
    """Whether a rival in an effect's place is refuted.

    Args:
        problem: with the fitted windows.
        holdout: with the validation windows.
        fit: with the effect.
        rest: without it.
        trial: the rival at the size at which it fits best beside `rest`.
        weights: (W,) of the fitted windows.
    """
    rule = problem.thresholds.selection.confounding.told_apart
    start = np.concatenate((rest.values, trial.values))
    other = gauss_newton(problem, (*rest.chosen, trial.candidate), start, weights, rule.iterations, known=fit)
    further = LeftOver(problem, other, weights).cost(other.residual)  # where more steps would lead
    if further - fit.cost < rule.settled * max(other.cost - fit.cost, 0.0) or other.cost < fit.cost:
        return False
    against = compare(problem, holdout, fit, other)
    sides = [against.fitted, *([against.validation] if against.validation else [])]
    worse = [_chi_square(old, new) for old, new in sides]
    if sum(worse) < rule.chi_square or against.passes(rule.windows):
        return False
    most = int(np.argmax(worse))
    share = _held_out_share(holdout.judge, other, fit) if most else explained_share(problem, other, fit, weights)
    return share < rule.numerics


def _chi_square(old: np.ndarray, new: np.ndarray) -> float:
    """By how much the weighted chi-square of residuals (W, M) is higher in `new`."""
    return float((window_weights(old)[:, None] * (new**2 - old**2)).sum())


def _held_out_share(problem: Problem, before: Fit, after: Fit) -> float:
    """Share that other integrators would make of the change from `before` to `after` on the validation windows."""
    old, new = problem.residual([before.effects, after.effects])
    none = np.empty((0, *old.shape))
    first, last = (replace(fit, residual=r, columns=none) for fit, r in ((before, old), (after, new)))
    return explained_share(problem, first, last, window_weights(last.clean(problem)))
