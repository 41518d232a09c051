"""A fit without some of its effects: refitted, simulated, or by the slopes that it has.

All begin with `Fit.without`; what they do about the residual, the nuisances and the other effects differs, and the name
says how.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, clipped, effects_at
from bumblebee.diagnosis.estimation import Fit, cost_of, gauss_newton, project, solve
from bumblebee.diagnosis.residuals import Problem, window_weights


def refitted(problem: Problem, chosen: Sequence[Candidate], values: np.ndarray, known: Fit | None = None) -> Fit:
    """All effects at their best from `values` (P,), windows weighed as the first trial leaves them.

    Sensitivities of a fit that is `known` are taken over where nothing near has changed.
    """
    residual = problem.residual([effects_at(chosen, clipped(chosen, values))])[0]
    _, nuisance = cost_of(problem, residual, np.ones(len(residual)))
    weights = window_weights(residual - np.tensordot(nuisance, problem.nuisance, axes=1))
    return gauss_newton(problem, chosen, values, weights, iterations=3, coarse=True, known=known)


def refitted_without(problem: Problem, fit: Fit, gone: Collection[Candidate], known: Fit | None = None) -> Fit:
    """The others at their best without some effects."""
    rest = fit.without(gone)
    return refitted(problem, rest.chosen, rest.values, known)


def simulated_without(problem: Problem, fit: Fit, gone: Collection[Candidate]) -> Fit:
    """The others where they are, simulated without some effects, with nuisances and columns of their own."""
    rest, ones = fit.without(gone), np.ones(len(problem.windows))
    bare = gauss_newton(problem, rest.chosen, rest.values, ones, iterations=0, known=fit)
    weights = window_weights(bare.clean(problem))
    return replace(bare, nuisance=cost_of(problem, bare.residual, weights)[1])


def columns_without(problem: Problem, fit: Fit, gone: Collection[Candidate]) -> Fit:
    """The others where they are, simulated without some effects, with the nuisances and columns that they had."""
    rest = fit.without(gone)
    return replace(rest, residual=problem.residual([rest.effects])[0])


def linearly_without(fit: Fit, gone: Candidate) -> Fit:
    """The others where they are; the residual grows by the linear part of the effect that is gone, unsimulated."""
    part = fit.slices[fit.chosen.index(gone)]
    moving = np.flatnonzero(fit.scales)
    rows = [k for k, m in enumerate(moving) if part.start <= m < part.stop]
    away = fit.values[part] - np.array(gone.nominal)
    linear = [away[moving[k] - part.start] / fit.scales[moving[k]] for k in rows]
    free = [moving[k] - part.start in gone.free for k in rows]
    grown = sum((a * fit.columns[k] for a, k, f in zip(linear, rows, free, strict=True) if f), np.zeros(1))
    return replace(fit.without([gone]), residual=fit.residual + grown)


def moved_without(problem: Problem, fit: Fit, weights: np.ndarray, gone: Collection[Candidate]) -> Fit:
    """The others moved by the slopes that the fit has, without some effects: nothing is simulated."""
    rest = fit.without(gone)
    moving = np.flatnonzero(fit.scales)
    back = (fit.values - np.concatenate([c.nominal for c in fit.chosen]))[moving] / fit.scales[moving]
    stays = np.concatenate([np.full(len(c.nominal), c not in gone) for c in fit.chosen])
    back[stays[moving]] = 0.0
    residual = fit.residual + np.tensordot(back, fit.columns, axes=1)
    basis, inverse = project(problem, rest.columns, weights)
    move = solve(basis, inverse, residual, weights)
    scales, wanted = rest.scales, rest.values.copy()
    wanted[scales > 0] += move[len(problem.nuisance) :] * scales[scales > 0]
    wanted = clipped(rest.chosen, wanted)
    moved = ((wanted - rest.values)[scales > 0]) / scales[scales > 0]
    residual = residual - np.tensordot(moved, rest.columns, axes=1)
    cost, nuisance = cost_of(problem, residual, weights)
    return Fit(rest.chosen, wanted, nuisance, residual, rest.columns, cost)


def linear_cost(problem: Problem, fit: Fit, weights: np.ndarray) -> float:
    """Cost of a fit, its effects and the nuisances free to move linearly."""
    basis, inverse = project(problem, fit.columns, weights)
    left = fit.residual - np.tensordot(solve(basis, inverse, fit.residual, weights), basis, axes=1)
    return float((weights[:, None] * left**2).sum())
