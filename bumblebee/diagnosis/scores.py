"""Score tests: what every candidate would gain, given those chosen, and how sure that is.

A candidate of F free parameters has F columns of whitened sensitivities. Its score on a window is their product with
what the chosen ones leave. How far each window's score is from what the candidate's estimate makes of that window, the
window's own pull taken out (CR3), gives the variance, whatever the residual's distribution is. The scores' plain
variance would count as noise that an effect acts more in some windows than in others: in contact that hid effects of 20
standard errors behind a z of 4.
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
_LONE = 1e-6  # keeps the variance finite where one window holds all that is known of a candidate


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
    scores, slices = parts.scores(left), columns.slices
    count = len(columns.candidates)
    steps, errors = [np.empty(0)] * count, [np.empty(0)] * count
    z, gain = np.zeros(count), np.zeros(count)
    sizes = np.array([s.stop - s.start for s in slices], dtype=int)
    for size in np.unique(sizes):
        which = np.flatnonzero(sizes == size)
        rows = np.stack([np.arange(slices[c].start, slices[c].stop) for c in which])
        curvature = np.stack([parts.curvature(slices[c]) for c in which])
        own = np.stack([parts.by_window(slices[c]) for c in which])
        tested = _tests(scores[rows], curvature, parts.raw[rows], own)
        for c, estimate, error in zip(which, tested[0], tested[1], strict=True):
            steps[c], errors[c] = estimate, error
        z[which], gain[which] = tested[2:]
    return Scores(steps, errors, z, gain)


class _Parts:
    """Columns with the basis taken out, without ever forming them."""

    def __init__(self, values: np.ndarray, basis: np.ndarray, inverse: np.ndarray, weights: np.ndarray) -> None:
        self._flat, self._values, self._basis, self._weights = values.reshape(len(values), -1), values, basis, weights
        weighted = (basis * weights[:, None]).reshape(len(basis), -1).astype(np.float32)
        self._cross = (self._flat @ weighted.T).astype(float)
        self._shares = self._cross @ inverse
        self._roots = np.sqrt(weights)[:, None, None].astype(np.float32)
        self._around = self._roots * basis.transpose(1, 2, 0).astype(np.float32)  # (W, M, B)
        self._normals = np.matmul(self._around.transpose(0, 2, 1), self._around).astype(float)  # (W, B, B)
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

    def by_window(self, rows: slice) -> np.ndarray:
        """Normal matrices (W, F, F) of some rows beside the basis, of each window alone."""
        own = self._values[rows].transpose(1, 0, 2) * self._roots
        shares = self._shares[rows]
        mixed = np.matmul(np.matmul(own, self._around).astype(float), shares.T)
        both = shares @ self._normals @ shares.T
        return np.matmul(own, own.transpose(0, 2, 1)).astype(float) - mixed - mixed.transpose(0, 2, 1) + both


def _tests(
    scores: np.ndarray, curvature: np.ndarray, raw: np.ndarray, own: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Estimates and errors (C, F), z and gain (C,) of candidates from scores (C, F, W) and curvatures (C, F, F).

    `own` (C, W, F, F) are the curvatures of single windows.
    """
    count, windows = scores.shape[1:]
    diagonal = np.einsum("cff->cf", curvature)
    seen = (diagonal > _SEEN * raw) & (diagonal > _LEAST_POWER)
    # Unseen rows become directions of their own, without a score: they change nothing.
    scores = scores * seen[..., None]
    curvature = np.where(seen[:, :, None] & seen[:, None, :], curvature, 0.0)
    inverse = np.linalg.pinv(curvature, rcond=1e-6, hermitian=True)
    total = scores.sum(axis=2)
    spread = _spread(scores, own, inverse)
    at = np.arange(count)
    spread[:, at, at] += np.maximum(0.25 * np.where(seen, diagonal, 0.0) - spread[:, at, at], 0.0)
    wald = np.einsum("cf,cfg,cg->c", total, np.linalg.pinv(spread, rcond=1e-9, hermitian=True), total)
    estimate = np.einsum("cfg,cg->cf", inverse, total)
    variance = np.einsum("cff->cf", np.matmul(np.matmul(inverse, spread), inverse))
    errors = np.where(seen, np.sqrt(np.maximum(variance, 0.0)), np.inf)
    left = seen.sum(axis=1)
    z = np.zeros(len(wald))
    for n in range(1, count + 1):
        z[left == n] = _as_z(wald[left == n], n, windows)
    return estimate, errors, z, np.einsum("cf,cf->c", total, estimate)


def _spread(scores: np.ndarray, own: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """Covariance (C, F, F) of summed scores (C, F, W) from how windows differ from what the estimate makes of them.

    `own` (C, W, F, F) are the windows' normal matrices, `inverse` (C, F, F) that of their sum. A window that alone
    says something of an effect is not at odds with it by construction: its score by its pull is added as doubt.
    """
    each = scores.transpose(0, 2, 1)[..., None]  # (C, W, F, 1)
    pull = np.matmul(own, inverse[:, None])
    left = each - np.matmul(pull, each.sum(axis=1, keepdims=True))
    rest = np.eye(scores.shape[1]) * (1 + _LONE) - pull
    left, doubt = np.linalg.solve(rest, left)[..., 0], np.matmul(pull, each)[..., 0]
    return np.matmul(left.transpose(0, 2, 1), left) + np.matmul(doubt.transpose(0, 2, 1), doubt)


def as_z(wald: float, count: int, windows: int) -> float:
    """A Wald statistic of `count` parameters over `windows` clusters as a two-sided standard normal."""
    return float(_as_z(np.array([wald]), count, windows)[0])


def _as_z(wald: np.ndarray, count: int, windows: int) -> np.ndarray:
    """The same of several statistics (C,)."""
    if count == 1:
        return np.sqrt(wald)
    share = windows - count
    log_p = np.zeros(len(wald))
    if share > 0:
        log_p = fisher.logsf(wald * share / (count * max(windows - 1, 1)), count, share)
    far = ~np.isfinite(log_p) | (log_p < -600)
    log_p[far] = chi2.logsf(np.minimum(wald[far], 1200.0), count)
    return norm.isf(np.exp(np.maximum(log_p, -600.0)) / 2)


def null_maxima(problem: Problem, columns: Columns, fit: Fit, weights: np.ndarray, draws: np.ndarray) -> np.ndarray:
    """Largest z (K,) over all columns, one by one, on residuals `draws` (K, W, M) of a complete model."""
    basis, inverse = project(problem, fit.columns, weights)
    parts = _Parts(columns.values, basis, inverse, weights)
    curvature = np.maximum(parts.diagonal(), 0.0)
    seen = (curvature > _SEEN * parts.raw) & (curvature > _LEAST_POWER)
    own = np.array([parts.by_window(slice(r, r + 1))[:, 0, 0] for r in np.flatnonzero(seen)]).reshape(seen.sum(), -1)
    pull = own / curvature[seen, None]
    out = np.zeros(len(draws))
    for k, draw in enumerate(draws):
        scores = parts.scores(draw - np.tensordot(solve(basis, inverse, draw, weights), basis, axes=1))[seen]
        left = (scores - pull * scores.sum(axis=1, keepdims=True)) / (1 + _LONE - pull)
        spread = (left**2).sum(axis=1) + ((pull * scores) ** 2).sum(axis=1)
        z = np.abs(scores.sum(axis=1)) / np.sqrt(np.maximum(spread, 0.25 * curvature[seen]))
        out[k] = z.max(initial=0.0)
    return out
