"""Score tests: what every candidate would gain, given those chosen, and how sure that is.

A candidate of F free parameters has F columns of whitened sensitivities. Its score on a window is their product with
what the chosen ones leave; the scores' variance over windows gives the test, whatever the residual's distribution is.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm
from scipy.stats import f as fisher

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.fit import Fit, project, solve
from bumblebee.diagnosis.problem import Problem

_SEEN = 1e-3  # share of a column's power that must be left beside the chosen ones
_LEAST_POWER = 1e-6


@dataclass(frozen=True, eq=False)
class Columns:
    """Columns of many candidates on one set of windows."""

    candidates: Sequence[Candidate]
    values: np.ndarray
    """(sum of F, W, M) float32."""

    @property
    def slices(self) -> list[slice]:
        """Rows of each candidate."""
        ends = np.cumsum([len(c.free) for c in self.candidates]).tolist()
        return [slice(end - len(c.free), end) for c, end in zip(self.candidates, ends, strict=True)]

    def only(self, keep: Sequence[int]) -> "Columns":
        """Those of some of the candidates."""
        slices = self.slices
        rows = np.concatenate([np.arange(slices[k].start, slices[k].stop) for k in keep])
        return Columns([self.candidates[k] for k in keep], self.values[rows])


@dataclass(frozen=True, eq=False)
class Scores:
    """Of C candidates, given a fit."""

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
    parts = _Parts(columns.values, basis, inverse, weights)
    steps, errors, z, gain = [], [], np.zeros(len(columns.candidates)), np.zeros(len(columns.candidates))
    scores = parts.scores(left)
    for c, rows in enumerate(columns.slices):
        estimate, error, z[c], gain[c] = _test(scores[rows], parts.curvature(rows), parts.raw[rows])
        steps.append(estimate)
        errors.append(error)
    return Scores(steps, errors, z, gain)


class _Parts:
    """Columns with the basis taken out, without ever forming them."""

    def __init__(self, values: np.ndarray, basis: np.ndarray, inverse: np.ndarray, weights: np.ndarray) -> None:
        self._flat, self._values, self._basis, self._weights = values.reshape(len(values), -1), values, basis, weights
        weighted = (basis * weights[:, None]).reshape(len(basis), -1).astype(np.float32)
        self._cross = (self._flat @ weighted.T).astype(float)
        self._shares = self._cross @ inverse
        self.raw = np.einsum("cwm,cwm,w->c", values, values, weights, optimize=True)

    def scores(self, left: np.ndarray) -> np.ndarray:
        """Scores (rows, W) of residuals (W, M) that are already free of the basis."""
        part = (left * self._weights[:, None]).astype(np.float32)
        own = np.matmul(self._values.transpose(1, 0, 2), part[:, :, None])[..., 0].T
        return own - self._shares @ np.matmul(self._basis.transpose(1, 0, 2), part[:, :, None])[..., 0].T

    def diagonal(self) -> np.ndarray:
        """Power (rows,) of every row beside the basis."""
        return self.raw - (self._shares * self._cross).sum(axis=1)

    def curvature(self, rows: slice) -> np.ndarray:
        """Normal matrix (F, F) of some rows beside the basis."""
        flat = self._flat[rows]
        if len(flat) == 1:
            own = np.array([[self.raw[rows.start]]])
        else:
            own = (flat * np.repeat(self._weights, self._values.shape[2]).astype(np.float32)) @ flat.T
        return own - self._shares[rows] @ self._cross[rows].T


def _test(scores: np.ndarray, curvature: np.ndarray, raw: np.ndarray) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Estimate, errors, z and gain of one candidate from its scores (F, W) and curvature (F, F)."""
    count, windows = scores.shape
    nothing = np.zeros(count), np.full(count, np.inf), 0.0, 0.0
    diagonal = np.diag(curvature)
    seen = (diagonal > _SEEN * raw) & (diagonal > _LEAST_POWER)
    if not seen.any():
        return nothing
    scores, curvature = scores[seen], curvature[np.ix_(seen, seen)]
    inverse = np.linalg.pinv(curvature, rcond=1e-6, hermitian=True)
    total = scores.sum(axis=1)
    spread = (scores - scores.mean(axis=1, keepdims=True)) @ (scores - scores.mean(axis=1, keepdims=True)).T
    spread += np.diag(np.maximum(0.25 * np.diag(curvature) - np.diag(spread), 0.0))
    wald = float(total @ np.linalg.pinv(spread, rcond=1e-9, hermitian=True) @ total)
    estimate, errors = np.zeros(count), np.full(count, np.inf)
    estimate[seen] = inverse @ total
    errors[seen] = np.sqrt(np.maximum(np.diag(inverse @ spread @ inverse), 0.0))
    return estimate, errors, as_z(wald, int(seen.sum()), windows), float(total @ inverse @ total)


def as_z(wald: float, count: int, windows: int) -> float:
    """A Wald statistic of `count` parameters over `windows` clusters as a two-sided standard normal."""
    if count == 1:
        return float(np.sqrt(wald))
    share = windows - count
    log_p = fisher.logsf(wald * share / (count * max(windows - 1, 1)), count, share) if share > 0 else 0.0
    if not np.isfinite(log_p) or log_p < -600:
        log_p = float(chi2.logsf(min(wald, 1200.0), count))
    return float(norm.isf(np.exp(max(log_p, -600.0)) / 2))


def null_maxima(problem: Problem, columns: Columns, fit: Fit, weights: np.ndarray, draws: np.ndarray) -> np.ndarray:
    """Largest z (K,) over all columns, one by one, on residuals `draws` (K, W, M) of a complete model."""
    basis, inverse = project(problem, fit.columns, weights)
    parts = _Parts(columns.values, basis, inverse, weights)
    curvature = np.maximum(parts.diagonal(), 0.0)
    seen = (curvature > _SEEN * parts.raw) & (curvature > _LEAST_POWER)
    out = np.zeros(len(draws))
    for k, draw in enumerate(draws):
        scores = parts.scores(draw - np.tensordot(solve(basis, inverse, draw, weights), basis, axes=1))[seen]
        spread = scores.var(axis=1) * scores.shape[1]
        z = np.abs(scores.sum(axis=1)) / np.sqrt(np.maximum(spread, 0.25 * curvature[seen]))
        out[k] = z.max(initial=0.0)
    return out
