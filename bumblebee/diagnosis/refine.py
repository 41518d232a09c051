"""The last fit: everything linearised and whitened around what was found, and freed from the bias of noisy starts.

A window starts from a noisy reading, and the sensitivities computed from it are wrong by what the residual is wrong by:
the estimate is drawn towards zero, as a regression is by noise in its regressors. How far follows from starts perturbed
once more: the mean product of their sensitivities and residuals is the score that noise alone makes.
"""

from dataclasses import dataclass, replace

import numpy as np

from bumblebee.diagnosis.fit import Fit, cost_of, effects_at, gauss_newton, interval, project
from bumblebee.diagnosis.problem import Problem, make_problem, rough, window_weights
from bumblebee.diagnosis.simulate import Starts
from bumblebee.diagnosis.whiten import perturbed_starts

_PAIRS = 4


@dataclass(frozen=True, eq=False)
class Refined:
    """The final fit, its problem and the intervals' half-widths."""

    problem: Problem
    fit: Fit
    weights: np.ndarray
    half: np.ndarray
    """(P,) of 95 % intervals; 0 for parameters that were not fitted."""


def refine(problem: Problem, fit: Fit, rng: np.random.Generator) -> Refined:
    """Whiten and linearise around `fit`, fit again, correct."""
    plant, layout, windows = problem.plant, problem.layout, problem.windows
    problem = make_problem(plant, layout, windows, problem.sigma, (problem.fine, problem.coarse), fit.effects, rng)
    residual = problem.residual([fit.effects])[0]
    _, nuisance = cost_of(problem, residual, window_weights(residual))
    weights = window_weights(residual - np.tensordot(nuisance, problem.nuisance, axes=1))
    fit = gauss_newton(problem, fit.chosen, fit.values, weights, iterations=3, coarse=True)
    fit = gauss_newton(problem, fit.chosen, fit.values, weights, iterations=1)
    if not fit.chosen:
        return Refined(problem, fit, weights, np.empty(0))
    bias, doubt = start_bias(problem, fit, weights, rng)
    _, half = interval(problem, fit, weights)
    values = np.concatenate(
        [c.clip(v) for c, v in zip(fit.chosen, np.split(fit.values - bias, _ends(fit)), strict=True)]
    )
    residual = problem.residual([effects_at(fit.chosen, values)])[0]
    return Refined(problem, replace(fit, values=values, residual=residual), weights, np.hypot(half, 1.96 * doubt))


def _ends(fit: Fit) -> np.ndarray:
    return np.cumsum([len(c.nominal) for c in fit.chosen])[:-1]


def start_bias(
    problem: Problem, fit: Fit, weights: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """What noise in the starts adds to every parameter (P,), and the standard error of that estimate (P,)."""
    starts = _pairs(problem, rng)
    scales, moving = fit.scales, np.flatnonzero(fit.scales)
    base = problem.residual([fit.effects], coarse=rough(e.effect for e in fit.effects))[0]
    here = _white(problem, problem.from_starts(fit.effects, starts))
    noise = here - base - (here - base).mean(axis=0)
    moved = []
    for i in moving:
        values = fit.values.copy()
        values[i] += 0.2 * scales[i]
        there = _white(problem, problem.from_starts(effects_at(fit.chosen, values), starts))
        moved.append((here - there) / 0.2)
    columns = np.stack(moved, axis=1)  # (K, P', W, M)
    basis, inverse = project(problem, fit.columns, weights)
    count = len(problem.nuisance)
    scores = np.einsum("kpwm,kwm,w->wp", columns - columns.mean(axis=0), noise, weights) / len(noise)
    total, out, doubt = np.zeros(len(basis)), np.zeros(len(scales)), np.zeros(len(scales))
    total[count:] = scores.sum(axis=0)
    out[moving] = (inverse @ total)[count:] * scales[moving]
    spread = np.zeros((len(basis), len(basis)))
    spread[count:, count:] = len(scores) * np.cov(scores.T).reshape(len(moving), -1)
    doubt[moving] = np.sqrt(np.maximum(np.diag(inverse @ spread @ inverse)[count:], 0.0)) * scales[moving]
    return out, doubt


def _white(problem: Problem, raw: np.ndarray) -> np.ndarray:
    """Whitened, windows that diverged set to nothing."""
    white = problem.whitener(raw)
    white[~np.isfinite(raw).all(axis=(-1, -2))] = 0.0
    return white


def _pairs(problem: Problem, rng: np.random.Generator) -> Starts:
    """A few perturbed starts and their mirror images."""
    every = perturbed_starts(problem.plant, problem.layout, problem.windows, problem.sigma, rng)
    some = rng.permutation(len(every.qpos))[:_PAIRS]
    centre_q, centre_v = problem.windows.qpos[None], problem.windows.qvel[None]
    q, v = every.qpos[some], every.qvel[some]
    return Starts(np.concatenate((q, 2 * centre_q - q)), np.concatenate((v, 2 * centre_v - v)))
