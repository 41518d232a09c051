"""The last fit: everything whitened and linearised around what was found."""

from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.fit import Fit, cost_of, gauss_newton, interval
from bumblebee.diagnosis.problem import Problem, make_problem, window_weights
from bumblebee.diagnosis.search import wald

_SURE = 3.0  # standard errors


@dataclass(frozen=True, eq=False)
class Refined:
    """The final fit, its problem and the intervals' half-widths."""

    problem: Problem
    fit: Fit
    weights: np.ndarray
    half: np.ndarray
    """(P,) of 95 % intervals; 0 for parameters that were not fitted."""


def refine(problem: Problem, fit: Fit, rng: np.random.Generator) -> Refined:
    """Whiten and linearise around `fit`, and fit again; a fit of nothing is as it should be already."""
    if not fit.chosen:
        return Refined(problem, fit, window_weights(fit.clean(problem)), np.empty(0))
    plant, layout, windows = problem.plant, problem.layout, problem.read
    problem = make_problem(plant, layout, windows, problem.sigma, (problem.fine, problem.coarse), fit.effects, rng)
    residual = problem.residual([fit.effects])[0]
    _, nuisance = cost_of(problem, residual, window_weights(residual))
    weights = window_weights(residual - np.tensordot(nuisance, problem.nuisance, axes=1))
    fit = gauss_newton(problem, fit.chosen, fit.values, weights, iterations=3, coarse=True)
    fit = gauss_newton(problem, fit.chosen, fit.values, weights, iterations=1)
    if not fit.chosen:
        return Refined(problem, fit, weights, np.empty(0))
    fit = _needed(problem, fit, weights)
    return Refined(problem, fit, weights, interval(problem, fit, weights))


def _needed(problem: Problem, fit: Fit, weights: np.ndarray) -> Fit:
    """The fit less effects that have come back to nothing, the least sure one at a time."""
    while fit.chosen:
        z = [wald(problem, fit, weights, i) for i in range(len(fit.chosen))]
        worst = int(np.argmin(z))
        if z[worst] >= _SURE:
            break
        keep = [i for i in range(len(fit.chosen)) if i != worst]
        values = [fit.values[fit.slices[i]] for i in keep]
        chosen = [fit.chosen[i] for i in keep]
        fit = gauss_newton(problem, chosen, np.concatenate(values) if values else [], weights, iterations=1)
    return fit
