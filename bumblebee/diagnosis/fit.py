"""Joint fit of the chosen effects: Gauss-Newton on whitened residuals, with the nuisances as further parameters."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.problem import Problem
from bumblebee.sim.effects import Effect

_ENOUGH_ROLLOUTS = 6  # fewer say little about how much rollouts differ


@dataclass(frozen=True, eq=False)
class Fit:
    """Chosen candidates with their values."""

    chosen: tuple[Candidate, ...]
    values: np.ndarray
    """(k,) parameters."""
    nuisance: np.ndarray
    """(3,) coefficients."""
    residual: np.ndarray
    """(W, M) whitened, nuisances not yet taken out."""
    columns: np.ndarray
    """(k, W, M) change of the prediction per candidate's step, at the fit."""
    cost: float

    @property
    def effects(self) -> list[Effect]:
        """The effects at their fitted values."""
        return [c.at(v) for c, v in zip(self.chosen, self.values, strict=True)]

    def clean(self, problem: Problem) -> np.ndarray:
        """Residual without nuisances (W, M)."""
        return self.residual - np.tensordot(self.nuisance, problem.nuisance, axes=1)


def project(problem: Problem, columns: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Basis of nuisances and columns (B, W, M) and the inverse of its weighted normal matrix (B, B)."""
    basis = np.concatenate((problem.nuisance, columns)) if len(columns) else problem.nuisance
    flat = (basis * np.sqrt(weights)[:, None]).reshape(len(basis), -1)
    normal = flat @ flat.T
    count = len(problem.nuisance)
    normal[np.arange(count), np.arange(count)] += 1.0  # the nuisances' prior
    normal[np.arange(count, len(normal)), np.arange(count, len(normal))] *= 1 + 1e-9
    return basis, np.linalg.inv(normal)


def solve(basis: np.ndarray, inverse: np.ndarray, residual: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Weighted least-squares coefficients (B,) of `residual` (W, M)."""
    return inverse @ np.einsum("bwm,wm->b", basis, residual * weights[:, None])


def cost_of(problem: Problem, residual: np.ndarray, weights: np.ndarray) -> tuple[float, np.ndarray]:
    """Weighted cost of a residual at its best nuisances, and these."""
    basis, inverse = project(problem, np.empty((0, *residual.shape)), weights)
    nuisance = solve(basis, inverse, residual, weights)
    left = residual - np.tensordot(nuisance, basis, axes=1)
    return float((weights[:, None] * left**2).sum() + nuisance @ nuisance), nuisance


def gauss_newton(
    problem: Problem,
    chosen: Sequence[Candidate],
    values: Sequence[float] | np.ndarray,
    weights: np.ndarray,
    iterations: int = 4,
) -> Fit:
    """Refit all chosen effects jointly, from `values`."""
    values = np.array([c.clip(v) for c, v in zip(chosen, values, strict=True)], dtype=float)
    residual = problem.residual([_effects(chosen, values)])[0]
    cost, nuisance = cost_of(problem, residual, weights)
    columns = _columns(problem, chosen, values, residual)
    steps = np.array([abs(c.step) for c in chosen])
    for _ in range(iterations if len(chosen) else 0):
        basis, inverse = project(problem, columns, weights)
        move = solve(basis, inverse, residual, weights)[len(problem.nuisance) :] * steps
        trials = [np.array([c.clip(v) for c, v in zip(chosen, values + s * move, strict=True)]) for s in (1.0, 0.4)]
        tried = problem.residual([_effects(chosen, v) for v in trials])
        costs = [cost_of(problem, r, weights) for r in tried]
        best = int(np.argmin([c for c, _ in costs]))
        if costs[best][0] >= cost - 1e-3:
            break
        small = np.all(np.abs(trials[best] - values) < 0.01 * steps)
        gained = cost - costs[best][0]
        values, residual, (cost, nuisance) = trials[best], tried[best], costs[best]
        columns = _columns(problem, chosen, values, residual)
        if small or gained < 0.05:
            break
    return Fit(tuple(chosen), values, nuisance, residual, columns, cost)


def _effects(chosen: Sequence[Candidate], values: Sequence[float] | np.ndarray) -> list[Effect]:
    return [c.at(v) for c, v in zip(chosen, values, strict=True)]


def _columns(problem: Problem, chosen: Sequence[Candidate], values: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Sensitivities (k, W, M) per |step| at `values`, by differences of a fifth of a step, away from the bound."""
    if not len(chosen):
        return np.empty((0, *residual.shape))
    moves = []
    for c, v in zip(chosen, values, strict=True):
        h = 0.2 * abs(c.step)
        moves.append(h if c.clip(v + h) == v + h else -h)
    sets = []
    for i, h in enumerate(moves):
        moved = values.copy()
        moved[i] += h
        sets.append(_effects(chosen, moved))
    tried = problem.residual(sets)
    scale = np.array([abs(c.step) / h for c, h in zip(chosen, moves, strict=True)])
    return (residual - tried) * scale[:, None, None]


def covariance(problem: Problem, fit: Fit, weights: np.ndarray, clusters: np.ndarray) -> np.ndarray:
    """Sandwich covariance (k, k) of the values, clustered over `clusters` (W,)."""
    basis, inverse = project(problem, fit.columns, weights)
    left = fit.clean(problem) * weights[:, None]
    scores = np.einsum("bwm,wm->wb", basis, left)
    groups = np.unique(clusters)
    summed = np.stack([scores[clusters == g].sum(axis=0) for g in groups])
    meat = summed.T @ summed * len(groups) / max(len(groups) - 1, 1)
    steps = np.array([abs(c.step) for c in fit.chosen])
    count = len(problem.nuisance)
    full = inverse @ meat @ inverse
    return full[count:, count:] * np.outer(steps, steps)


def standard_errors(problem: Problem, fit: Fit, weights: np.ndarray) -> np.ndarray:
    """(k,) of the sizes: over windows, or over rollouts where these vary more and are enough to tell."""
    windows = np.sqrt(np.diag(covariance(problem, fit, weights, np.arange(len(weights)))))
    groups = problem.windows.rollout
    if len(np.unique(groups)) < _ENOUGH_ROLLOUTS:
        return windows
    return np.maximum(windows, np.sqrt(np.diag(covariance(problem, fit, weights, groups))))


def interval(problem: Problem, fit: Fit, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Standard errors (k,) and half-widths of 95 % intervals (k,): windows, or rollouts where they vary more."""
    windows = np.sqrt(np.diag(covariance(problem, fit, weights, np.arange(len(weights)))))
    half = student.ppf(0.975, max(len(weights) - len(fit.chosen) - 1, 2)) * windows
    groups = len(np.unique(problem.windows.rollout))
    if groups >= _ENOUGH_ROLLOUTS:
        rollouts = np.sqrt(np.diag(covariance(problem, fit, weights, problem.windows.rollout)))
        half = np.maximum(half, student.ppf(0.975, groups - 1) * rollouts)
    return windows, half
