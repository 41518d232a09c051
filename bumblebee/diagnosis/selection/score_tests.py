"""Score tests: what every candidate would gain, given those chosen, and how sure that is.

A candidate of F free parameters has F columns of whitened sensitivities. Its score on a window is their product with
what the chosen ones leave. How far each window's score is from what the candidate's estimate makes of that window, the
window's own pull taken out (CR3), gives the variance, whatever the residual's distribution is. The scores' plain
variance would count as noise that an effect acts more in some windows than in others: in contact that hid effects of 20
standard errors behind a z of 4.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from bumblebee.diagnosis.comparison import z_values
from bumblebee.diagnosis.estimation import Fit, project, solve
from bumblebee.diagnosis.residuals import Problem, null_draws
from bumblebee.diagnosis.sensitivities import Columns
from bumblebee.diagnosis.thresholds.selection import ScoreTests


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores of C candidates, given a fit."""

    steps: list[np.ndarray]
    """Estimates (F,) in steps of the free parameters."""
    errors: list[np.ndarray]
    """Their standard errors (F,) in steps; infinite where the data say nothing."""
    z: np.ndarray
    """(C,) the test's p-value as a two-sided standard normal."""
    gain: np.ndarray
    """(C,) fall of the cost."""


def score_tests(problem: Problem, columns: Columns, fit: Fit, weights: np.ndarray) -> Scores:
    """Test every candidate given the fit (on the same windows)."""
    basis, inverse = project(problem, fit.columns, weights)
    left = fit.residual - np.tensordot(solve(basis, inverse, fit.residual, weights), basis, axes=1)
    parts, rule = _Parts(columns.values, basis, inverse, weights), problem.thresholds.selection.score_tests
    scores, slices = next(parts.scores(left[None])), columns.slices
    count = len(columns.candidates)
    steps, errors = [np.empty(0)] * count, [np.empty(0)] * count
    z, gain = np.zeros(count), np.zeros(count)
    sizes = np.array([s.stop - s.start for s in slices], dtype=int)
    for size in np.unique(sizes):
        which = np.flatnonzero(sizes == size)
        rows = np.stack([np.arange(slices[c].start, slices[c].stop) for c in which])
        own = parts.by_window(rows)
        tested = _tests(scores[rows], parts.curvature(rows, own), parts.raw[rows], own, rule)
        for c, estimate, error in zip(which, tested[0], tested[1], strict=True):
            steps[c], errors[c] = estimate, error
        z[which], gain[which] = tested[2:]
    return Scores(steps, errors, z, gain)


class _Parts:
    """Columns with the basis taken out, without ever forming them."""

    def __init__(self, values: np.ndarray, basis: np.ndarray, inverse: np.ndarray, weights: np.ndarray) -> None:
        self._values, self._basis, self._weights = values, basis, weights
        around = (basis * weights[:, None]).transpose(1, 2, 0).astype(np.float32)  # (W, M, B)
        self._mixed = np.matmul(values.transpose(1, 0, 2), around).astype(float)  # (W, rows, B)
        self._cross = self._mixed.sum(axis=0)
        self._shares = self._cross @ inverse
        self._normals = np.matmul(basis.transpose(1, 0, 2).astype(np.float32), around).astype(float)  # (W, B, B)
        self._power = np.einsum("cwm,cwm->cw", values, values) * weights
        self.raw = self._power.sum(axis=1)

    def scores(self, left: np.ndarray) -> Iterator[np.ndarray]:
        """Scores (rows, W) of each of some residuals (K, W, M) that are already free of the basis."""
        part = (left * self._weights[:, None]).astype(np.float32).transpose(1, 2, 0)  # (W, M, K)
        own = np.matmul(self._values.transpose(1, 0, 2), part)  # (W, rows, K)
        around = np.matmul(self._basis.transpose(1, 0, 2).astype(np.float32), part)
        for k in range(len(left)):
            yield own[:, :, k].T - self._shares @ around[:, :, k].T

    def diagonal(self) -> np.ndarray:
        """Power (rows,) of every row beside the basis."""
        return self.raw - (self._shares * self._cross).sum(axis=1)

    def by_window(self, rows: np.ndarray) -> np.ndarray:
        """Normal matrices (C, W, F, F), beside the basis, of C candidates' rows (C, F), of each window alone."""
        count = rows.shape[1]
        out = np.empty((len(rows), len(self._weights), count, count))
        for f, g in itertools.combinations_with_replacement(range(count), 2):
            a, b = rows[:, f], rows[:, g]
            one = self._power[a] if f == g else self._product(a, b)
            first, second = self._shares[a], self._shares[b]
            mixed = (self._mixed[:, a] * second).sum(axis=2) + (self._mixed[:, b] * first).sum(axis=2)
            both = (np.matmul(first, self._normals) * second).sum(axis=2)
            out[:, :, f, g] = out[:, :, g, f] = one - (mixed - both).T
        return out

    def curvature(self, rows: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Normal matrices (C, F, F) of rows (C, F) beside the basis and its prior, from `own` of `by_window`."""
        cross, shares = self._cross[rows], self._shares[rows]
        prior = cross - shares @ self._normals.sum(axis=0)
        return own.sum(axis=1) + np.matmul(shares, prior.transpose(0, 2, 1))

    def _product(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Weighted products (C, W) of the rows `a` (C,) with the rows `b` (C,)."""
        return np.einsum("cwm,cwm->cw", self._values[a], self._values[b]) * self._weights


def _tests(
    scores: np.ndarray, curvature: np.ndarray, raw: np.ndarray, own: np.ndarray, rule: ScoreTests
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Estimates and errors (C, F), z and gain (C,) of candidates from scores (C, F, W) and curvatures (C, F, F).

    `own` (C, W, F, F) are the curvatures of single windows.
    """
    count, windows = scores.shape[1:]
    diagonal = np.einsum("cff->cf", curvature)
    seen = (diagonal > rule.seen * raw) & (diagonal > rule.least_power)
    # Unseen rows become directions of their own, without a score: they change nothing.
    scores = scores * seen[..., None]
    curvature = np.where(seen[:, :, None] & seen[:, None, :], curvature, 0.0)
    inverse = np.linalg.pinv(curvature, rcond=1e-6, hermitian=True)
    total = scores.sum(axis=2)
    spread = _spread(scores, own, inverse, rule.lone)
    at = np.arange(count)
    spread[:, at, at] += np.maximum(0.25 * np.where(seen, diagonal, 0.0) - spread[:, at, at], 0.0)
    wald = np.einsum("cf,cfg,cg->c", total, np.linalg.pinv(spread, rcond=1e-9, hermitian=True), total)
    estimate = np.einsum("cfg,cg->cf", inverse, total)
    variance = np.einsum("cff->cf", np.matmul(np.matmul(inverse, spread), inverse))
    errors = np.where(seen, np.sqrt(np.maximum(variance, 0.0)), np.inf)
    left = seen.sum(axis=1)
    z = np.zeros(len(wald))
    for n in range(1, count + 1):
        z[left == n] = z_values(wald[left == n], n, windows)
    return estimate, errors, z, np.einsum("cf,cf->c", total, estimate)


def _spread(scores: np.ndarray, own: np.ndarray, inverse: np.ndarray, lone: float) -> np.ndarray:
    """Covariance (C, F, F) of summed scores (C, F, W) from how windows differ from what the estimate makes of them.

    `own` (C, W, F, F) are the windows' normal matrices, `inverse` (C, F, F) that of their sum. A window that alone
    says something of an effect is not at odds with it by construction: its score by its pull is added as doubt.
    """
    each = scores.transpose(0, 2, 1)[..., None]  # (C, W, F, 1)
    pull = np.matmul(own, inverse[:, None])
    left = each - np.matmul(pull, each.sum(axis=1, keepdims=True))
    rest = np.eye(scores.shape[1]) * (1 + lone) - pull
    left, doubt = np.linalg.solve(rest, left)[..., 0], np.matmul(pull, each)[..., 0]
    return np.matmul(left.transpose(0, 2, 1), left) + np.matmul(doubt.transpose(0, 2, 1), doubt)


def null_maxima(problem: Problem, columns: Columns, fit: Fit, weights: np.ndarray, draws: np.ndarray) -> np.ndarray:
    """Largest z (K,) over all columns, one by one, on residuals `draws` (K, W, M) of a complete model."""
    basis, inverse = project(problem, fit.columns, weights)
    parts, rule = _Parts(columns.values, basis, inverse, weights), problem.thresholds.selection.score_tests
    curvature = np.maximum(parts.diagonal(), 0.0)
    seen = (curvature > rule.seen * parts.raw) & (curvature > rule.least_power)
    own = parts.by_window(np.flatnonzero(seen)[:, None])[..., 0, 0]
    pull = own / curvature[seen, None]
    out = np.zeros(len(draws))
    free = [draw - np.tensordot(solve(basis, inverse, draw, weights), basis, axes=1) for draw in draws]
    for k, drawn in enumerate(parts.scores(np.stack(free))):
        scores = drawn[seen]
        left = (scores - pull * scores.sum(axis=1, keepdims=True)) / (1 + rule.lone - pull)
        spread = (left**2).sum(axis=1) + ((pull * scores) ** 2).sum(axis=1)
        z = np.abs(scores.sum(axis=1)) / np.sqrt(np.maximum(spread, 0.25 * curvature[seen]))
        out[k] = z.max(initial=0.0)
    return out


def least_z(problem: Problem, columns: Columns, fit: Fit, count: int, level: float) -> float:
    """The z for `level` over `count` candidates: Bonferroni's, or that of simulated null datasets if higher.

    `columns` (of all candidates) and `fit` are on the windows of `problem`.
    """
    draws = null_draws(problem.whitener, problem.sigma, np.random.default_rng(0))
    maxima = null_maxima(problem, columns, fit, np.ones(len(problem.windows)), draws)
    scale = maxima.std() * np.sqrt(6) / np.pi  # a Gumbel distribution of the same mean and variance
    simulated = maxima.mean() - scale * (np.euler_gamma + np.log(-np.log1p(-level)))
    return float(max(norm.isf(level / (2 * count)), simulated))
