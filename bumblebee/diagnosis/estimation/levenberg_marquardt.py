"""A fit that begins far from the data, where slopes lead astray: Levenberg's and Marquardt's steps within bounds."""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, clipped, effects_at
from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.estimation.jacobian import columns_at
from bumblebee.diagnosis.estimation.least_squares import cost_of, project
from bumblebee.diagnosis.residuals import Problem, window_weights


def levenberg_marquardt(problem: Problem, chosen: Sequence[Candidate], values: np.ndarray, steps: int) -> Fit:
    """A fit from values (P,) with large residuals: Levenberg's and Marquardt's steps, windows weighed anew at each."""
    rule = problem.thresholds.estimation.levenberg_marquardt
    weights = window_weights(problem.residual([effects_at(chosen, values)])[0])
    fit = gauss_newton(problem, chosen, values, weights, iterations=0, coarse=True)
    damping, moving = rule.damping, np.flatnonzero(fit.scales)
    at = np.tile(fit.values, (len(moving), 1))
    for _ in range(steps):
        weights = window_weights(fit.clean(problem))
        cost = cost_of(problem, fit.residual, weights)[0]
        while damping < rule.most_damping:
            trial = _moved(problem, fit, weights, damping)
            residual = problem.residual([effects_at(chosen, trial)])[0]
            new, nuisance = cost_of(problem, residual, weights)
            if new < cost:
                break
            damping *= rule.more_damping
        else:
            break
        columns = columns_at(problem, chosen, trial, fit.scales, True, fit.columns, at)
        fit = Fit(fit.chosen, trial, nuisance, residual, columns, new)
        damping = max(rule.less_damping * damping, rule.damping)
        if new > rule.settled * cost:
            break
    return fit


def _moved(problem: Problem, fit: Fit, weights: np.ndarray, damping: float) -> np.ndarray:
    """Values (P,) after one step; what the data hardly tell stays within ten changes that matter of where it is.

    What would leave its bounds is held there and the others are solved for anew: their step was meant beside a friction
    or an inertia below zero.
    """
    rule = problem.thresholds.estimation.levenberg_marquardt
    basis, _ = project(problem, fit.columns, weights)
    flat = (basis * np.sqrt(weights)[:, None]).reshape(len(basis), -1)
    normal, count = flat @ flat.T, len(problem.nuisance)
    own = np.arange(len(normal))
    power = max(float((weights[:, None] * fit.clean(problem) ** 2).mean()), 1.0)
    normal[own[:count], own[:count]] += problem.prior
    normal[own[count:], own[count:]] += damping * normal[own[count:], own[count:]] + power / rule.free**2
    wanted = flat @ (fit.residual * np.sqrt(weights)[:, None]).ravel()
    moving, move, held = np.flatnonzero(fit.scales), np.zeros(len(normal)), np.zeros(len(normal), dtype=bool)
    while True:
        move[~held] = np.linalg.solve(normal[~held][:, ~held], (wanted - normal[:, held] @ move[held])[~held])
        values = fit.values.copy()
        values[moving] += move[count:] * fit.scales[moving]
        inside = clipped(fit.chosen, values)
        beyond = np.concatenate((np.zeros(count, dtype=bool), inside[moving] != values[moving])) & ~held
        if not beyond.any():
            return inside
        move[count:][beyond[count:]] = ((inside - fit.values)[moving] / fit.scales[moving])[beyond[count:]]
        held |= beyond
