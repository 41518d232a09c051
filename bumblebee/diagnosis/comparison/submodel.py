"""A fit with an effect more or less, refitted; and what a fit is worth for its parameters."""

from collections.abc import Sequence
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


def without_one(
    chosen: Sequence[Candidate], values: np.ndarray, gone: Candidate
) -> tuple[tuple[Candidate, ...], np.ndarray]:
    """The chosen effects and their values less one."""
    keep, at = [], 0
    for c in chosen:
        if c is not gone:
            keep += list(range(at, at + len(c.nominal)))
        at += len(c.nominal)
    return tuple(c for c in chosen if c is not gone), values[keep]


def less(problem: Problem, fit: Fit, gone: Sequence[Candidate]) -> Fit:
    """The fit less some effects, the others where they are."""
    chosen, values = fit.chosen, fit.values
    for c in gone:
        chosen, values = without_one(chosen, values, c)
    ones = np.ones(len(problem.windows))
    bare = gauss_newton(problem, chosen, values, ones, iterations=0, known=fit)
    weights = window_weights(bare.clean(problem))
    return replace(bare, nuisance=cost_of(problem, bare.residual, weights)[1])


def linearly_without(fit: Fit, index: int) -> Fit:
    """The fit less one effect: its residual grows by that effect's linear part."""
    part = fit.slices[index]
    moving = np.flatnonzero(fit.scales)
    rows = [k for k, m in enumerate(moving) if part.start <= m < part.stop]
    candidate = fit.chosen[index]
    away = fit.values[part] - np.array(candidate.nominal)
    linear = [away[moving[k] - part.start] / fit.scales[moving[k]] for k in rows]
    free = [moving[k] - part.start in candidate.free for k in rows]
    grown = sum((a * fit.columns[k] for a, k, f in zip(linear, rows, free, strict=True) if f), np.zeros(1))
    keep = [k for k in range(len(moving)) if k not in rows]
    others = [i for i in range(len(fit.values)) if not part.start <= i < part.stop]
    return replace(
        fit,
        chosen=tuple(c for k, c in enumerate(fit.chosen) if k != index),
        values=fit.values[others],
        residual=fit.residual + grown,
        columns=fit.columns[keep],
    )


def with_columns_without(problem: Problem, fit: Fit, gone: Sequence[Candidate]) -> Fit:
    """The fit less some effects, the others where they are, with the columns that they had."""
    keep = [i for i, c in enumerate(fit.chosen) if c not in gone]
    owner = [i for i, c in enumerate(fit.chosen) for _ in range(int(np.count_nonzero(c.scales)))]
    effects = [fit.effects[i] for i in keep]
    values = np.concatenate([np.empty(0), *(fit.values[fit.slices[i]] for i in keep)])
    return replace(
        fit,
        chosen=tuple(fit.chosen[i] for i in keep),
        values=values,
        residual=problem.residual([effects])[0],
        columns=fit.columns[[i in keep for i in owner]],
    )


def linear_cost(problem: Problem, fit: Fit, weights: np.ndarray) -> float:
    """Cost of a fit, its effects and the nuisances free to move linearly."""
    basis, inverse = project(problem, fit.columns, weights)
    left = fit.residual - np.tensordot(solve(basis, inverse, fit.residual, weights), basis, axes=1)
    return float((weights[:, None] * left**2).sum())


def without_some(problem: Problem, fit: Fit, weights: np.ndarray, gone: set[int]) -> Fit:
    """The fit less the effects of the numbers `gone`, all by the slopes that it has: nothing is simulated."""
    keep = [k for k in range(len(fit.chosen)) if k not in gone]
    chosen = tuple(fit.chosen[k] for k in keep)
    stays = np.concatenate([np.full(len(c.nominal), k not in gone) for k, c in enumerate(fit.chosen)])
    moving = np.flatnonzero(fit.scales)
    back = (fit.values - np.concatenate([c.nominal for c in fit.chosen]))[moving] / fit.scales[moving]
    back[stays[moving]] = 0.0
    residual = fit.residual + np.tensordot(back, fit.columns, axes=1)
    columns = fit.columns[stays[moving]]
    basis, inverse = project(problem, columns, weights)
    move = solve(basis, inverse, residual, weights)
    values, scales = fit.values[stays], fit.scales[stays]
    wanted = values.copy()
    wanted[scales > 0] += move[len(problem.nuisance) :] * scales[scales > 0]
    wanted = clipped(chosen, wanted)
    moved = ((wanted - values)[scales > 0]) / scales[scales > 0]
    residual = residual - np.tensordot(moved, columns, axes=1)
    cost, nuisance = cost_of(problem, residual, weights)
    return Fit(chosen, wanted, nuisance, residual, columns, cost)
