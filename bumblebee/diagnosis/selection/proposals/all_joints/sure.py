"""Sure effects among many that were fitted together, on all windows."""

import numpy as np

from bumblebee.diagnosis.comparison import drop_unsure
from bumblebee.diagnosis.estimation import Fit, cost_of, gauss_newton
from bumblebee.diagnosis.residuals import Problem, by_misfit, window_weights


def sure_of(problem: Problem, fit: Fit, known: Fit | None = None, simulated: bool = False) -> Fit | None:
    """The effects fitted on all windows, less those that are not sure there; `known` is a fit of these windows.

    Whether each one's going is `simulated`: of a humanoid's hundred effects too many go by slopes alone.
    """
    for _ in range(problem.thresholds.selection.proposals.all_joints.rounds):
        if not fit.chosen:
            return None
        fit = _fitted(problem, fit, 2, known)
        sure = drop_unsure(problem, fit, window_weights(fit.clean(problem)), simulated)
        if sure.chosen == fit.chosen:
            return fit
        known, fit = fit, sure
    return _fitted(problem, fit, 0, known) if fit.chosen else None  # what was dropped last, by slopes alone


def sure_by_misfit(problem: Problem, fit: Fit) -> Fit | None:
    """The sure effects where the windows stay far from the noise: sure by what is left, not by the noise.

    By the noise's measure hardly any effect would be sure there.
    """
    residual = problem.residual([fit.effects])[0]
    _, nuisance = cost_of(problem, residual, window_weights(residual))
    other = by_misfit(problem, residual - np.tensordot(nuisance, problem.nuisance, axes=1))
    fitted = _fitted(other, fit, 2)
    sure = sure_of(other, fitted, fitted)
    return None if sure is None else _fitted(problem, sure, 0)


def _fitted(problem: Problem, fit: Fit, iterations: int, known: Fit | None = None) -> Fit:
    """The effects fitted from where they are, windows weighed by what is left there."""
    weights = window_weights(problem.residual([fit.effects])[0])
    least = problem.thresholds.estimation.levenberg_marquardt.damping
    return gauss_newton(problem, fit.chosen, fit.values, weights, iterations, coarse=True, damping=least, known=known)
