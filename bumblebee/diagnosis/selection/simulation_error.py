"""Values of a model that is far from the noise: those that predict best, by the error of its simulation.

By maximum likelihood a reading weighs as little as its noise and its start's noise make it uncertain. That is right
while noise is what is left. Of a machine with more in it than any model, a thousand times the noise may be left: the
weights are then those of a question that nobody asked, and what a model is for is to predict. On a small servo with
dry friction the likelihood's values were further off after 1 s than those that the search had begun with. Here the
chosen effects stay and their values move to the least mean square of simulated against measured readings, each signal
in units of what is left of it, without the nuisances, which no corrected model holds: the simulation-error method of
system identification (Ljung, System Identification, 2nd ed., ch. 7, output error).
"""

from dataclasses import replace

import numpy as np
from scipy.linalg import solve_triangular

from bumblebee.diagnosis.comparison import Holdout
from bumblebee.diagnosis.estimation import Fit, gauss_newton, interval
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.final_fit import Refined
from bumblebee.diagnosis.simulation import Recall


def least_simulation_error(last: Refined, holdout: Holdout) -> Refined:
    """The last fit at the values that predict best; as it is where noise is its measure, or they predict no better.

    They must be no worse on the validation windows, nor after 1 s; without such windows nothing is moved.
    """
    problem, fit = last.problem, last.fit
    rule = problem.thresholds.selection.simulation_error
    if not fit.chosen or holdout.problem is None or fit.power(problem) < rule.far:
        return last
    size = signal_errors(problem, fit)
    plain, same = in_signal_units(problem, size), np.ones(len(problem.windows))
    moved = gauss_newton(plain, fit.chosen, fit.values, same, rule.iterations)
    judged = in_signal_units(holdout.problem, size).residual([fit.effects, moved.effects])
    before, after = (judged**2).mean(axis=(1, 2))
    there = gauss_newton(problem, fit.chosen, moved.values, last.weights, iterations=0)
    if after > before or holdout.worse_later(fit, there):
        return last
    return Refined(problem, there, last.weights, interval(plain, moved, same))


def signal_errors(problem: Problem, fit: Fit) -> np.ndarray:
    """(D,) root mean square of what a fit leaves of each signal, in the signal's unit; never less than its noise."""
    ones = in_signal_units(problem, np.ones(len(problem.sigma)))
    left = ones.residual([fit.effects])[0].reshape(len(problem.windows), -1, len(problem.sigma))
    return np.maximum(np.sqrt((left**2).mean(axis=(0, 1))), problem.sigma)


def in_signal_units(problem: Problem, size: np.ndarray) -> Problem:
    """The problem with every reading in units of its signal's `size` (D,) in place of whitened, and no nuisances."""
    old = problem.whitener
    windows, values = old.curvature.shape
    scale = np.tile(size, values // len(size))
    slopes = np.empty_like(old.slopes)
    for w in range(windows):
        slopes[w] = solve_triangular(old.factor[w], old.slopes[w].T, lower=True).T / scale
    whitener = replace(
        old,
        factor=np.broadcast_to(np.diag(1.0 / scale), old.factor.shape),
        offset=np.zeros_like(old.offset),
        curvature=np.zeros_like(old.curvature),
        moved=old.moved[:0],
        slopes=slopes,
    )
    return replace(problem, whitener=whitener, nuisance=np.zeros_like(problem.nuisance), recall=Recall())
