"""The joint refit of all chosen effects by Gauss-Newton's steps on whitened residuals."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, clipped, effects_at
from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.estimation.jacobian import columns_at, taken_over
from bumblebee.diagnosis.estimation.least_squares import cost_of, project, solve
from bumblebee.diagnosis.residuals import Problem


def resolved(problem: Problem, fit: Fit, weights: np.ndarray) -> Fit:
    """The fit with the nuisances and the cost of other nuisance columns or weights; its values stay."""
    cost, nuisance = cost_of(problem, fit.residual, weights)
    return replace(fit, nuisance=nuisance, cost=cost)


def gauss_newton(
    problem: Problem,
    chosen: Sequence[Candidate],
    values: Sequence[float] | np.ndarray,
    weights: np.ndarray,
    iterations: int = 4,
    coarse: bool = False,
    damping: float = 1e-9,
    known: Fit | None = None,
    held: Collection[Candidate] = (),
) -> Fit:
    """Refit all chosen effects jointly, from `values` (P,); `coarse` takes the sensitivities from coarse steps.

    With `damping` (Marquardt's) what the data hardly tell stays where it is. Sensitivities of a fit that is `known` of
    the same windows are taken over where nothing near has changed, and simulated again where something near has moved,
    but for those of effects that are `held`: they are simulated once.
    """
    values = clipped(chosen, np.asarray(values, dtype=float))
    residual = problem.residual([effects_at(chosen, values)])[0]
    cost, nuisance = cost_of(problem, residual, weights)
    scales = np.concatenate([c.scales for c in chosen]) if len(chosen) else np.empty(0)
    moving = np.flatnonzero(scales)
    columns, at = taken_over(problem, chosen, values, moving, known)
    hold = np.repeat([c in held for c in chosen], [len(c.nominal) for c in chosen]).astype(bool)[moving]
    columns = columns_at(problem, chosen, values, scales, coarse, columns, at, hold)
    for _ in range(iterations if len(chosen) else 0):
        basis, inverse = project(problem, columns, weights, damping)
        move = np.zeros(len(values))
        move[moving] = solve(basis, inverse, residual, weights)[len(problem.nuisance) :] * scales[moving]
        for share in (1.0, 0.4):
            trial = clipped(chosen, values + share * move)
            tried = problem.residual([effects_at(chosen, trial)])[0]
            new = cost_of(problem, tried, weights)
            if new[0] < cost - 1e-3:
                break
        else:
            break
        small = np.all(np.abs(trial - values) <= 0.01 * scales)
        gained = cost - new[0]
        values, residual, (cost, nuisance) = trial, tried, new
        if not small:
            columns = columns_at(problem, chosen, values, scales, coarse, columns, at, hold)
        if small or gained < 0.05:
            break
    return Fit(tuple(chosen), values, nuisance, residual, columns, cost)
