"""Covariance of the fitted values: by windows, by rollouts, by the noise; and 95 % intervals."""

import numpy as np
from scipy.stats import t as student

from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.estimation.least_squares import project
from bumblebee.diagnosis.residuals import Problem

_TOLD = 1e-6
"""Chi-square of a change that matters, below which the windows say nothing of a parameter."""


def covariance(problem: Problem, fit: Fit, weights: np.ndarray, clusters: np.ndarray) -> np.ndarray:
    """Covariance (P, P) of the values by leaving out one cluster (W,) after the other; 0 for what is not fitted.

    The jackknife of a linear fit (CR3 of the literature on clustered data): with few clusters, or few that say much, a
    plain sandwich is too narrow, for the fit has bent to each of them.
    """
    full, scores, normals = _clustered(problem, fit, weights, clusters)
    # Pseudo-inverse: without the one cluster in which an effect acts nothing is known of it.
    rest = np.linalg.pinv(full - normals, rcond=1e-12, hermitian=True)
    moves = np.einsum("cij,cj->ci", rest, scores)
    count = len(moves)
    moves = moves - moves.mean(axis=0)
    return _scaled(problem, fit, moves.T @ moves * (count - 1) / count)


def expected_covariance(problem: Problem, fit: Fit, weights: np.ndarray) -> np.ndarray:
    """Covariance (P, P) that whitened noise of the residual's own power gives."""
    basis, inverse = project(problem, fit.columns, weights)
    flat = (basis * weights[:, None]).reshape(len(basis), -1)
    power = max(fit.power(problem), 1.0)
    return _scaled(problem, fit, power * inverse @ (flat @ flat.T) @ inverse)


def freedom(problem: Problem, fit: Fit, weights: np.ndarray, clusters: np.ndarray) -> np.ndarray:
    """Degrees of freedom (P,): how many clusters say what is known of each parameter (Satterthwaite), less one."""
    full, _, normals = _clustered(problem, fit, weights, clusters)
    inverse = np.linalg.pinv(full, rcond=1e-12, hermitian=True)
    shares = np.stack([np.diag(inverse @ n @ inverse) for n in normals])
    number = shares.sum(axis=0) ** 2 / np.maximum((shares**2).sum(axis=0), 1e-300)
    out = np.full(len(fit.scales), np.inf)
    out[np.flatnonzero(fit.scales)] = np.maximum(number[len(problem.nuisance) :] - 1, 1.0)
    return out


def _clustered(
    problem: Problem, fit: Fit, weights: np.ndarray, clusters: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normal matrix (B, B) of nuisances and columns; scores (G, B) and normal matrices (G, B, B) of the clusters."""
    basis, _ = project(problem, fit.columns, weights)
    rows = basis.transpose(1, 0, 2)
    scores = np.matmul(rows, (fit.clean(problem) * weights[:, None])[:, :, None])[..., 0]
    normals = np.matmul(rows * weights[:, None, None], rows.transpose(0, 2, 1))
    groups = np.unique(clusters)
    prior = np.zeros(len(basis))
    prior[: len(problem.nuisance)] = problem.prior
    summed = np.stack([normals[clusters == g].sum(axis=0) for g in groups])
    full = summed.sum(axis=0) + np.diag(prior)
    full[np.diag_indices(len(full))] *= 1 + 1e-9
    return full, np.stack([scores[clusters == g].sum(axis=0) for g in groups]), summed


def _scaled(problem: Problem, fit: Fit, full: np.ndarray) -> np.ndarray:
    """The block (P, P) of the parameters, in their own units, of a matrix over nuisances and columns."""
    scales, count = fit.scales, len(problem.nuisance)
    moving = np.flatnonzero(scales)
    out = np.zeros((len(scales), len(scales)))
    out[np.ix_(moving, moving)] = full[count:, count:] * np.outer(scales[moving], scales[moving])
    return out


def standard_covariance(problem: Problem, fit: Fit, weights: np.ndarray) -> np.ndarray:
    """(P, P): over windows, never less than the noise gives; wider where rollouts vary more and are enough to tell."""
    windows = covariance(problem, fit, weights, np.arange(len(weights)))
    least = np.diag(windows)
    wider = np.diag(expected_covariance(problem, fit, weights))
    groups = problem.windows.rollout
    if len(np.unique(groups)) >= problem.thresholds.estimation.covariance.enough_rollouts:
        wider = np.maximum(wider, np.diag(covariance(problem, fit, weights, groups)))
    ratio = np.sqrt(np.maximum(wider / np.maximum(least, 1e-300), 1.0))
    return windows * np.outer(ratio, ratio)


def interval(problem: Problem, fit: Fit, weights: np.ndarray) -> np.ndarray:
    """Half-widths (P,) of 95 % intervals: the widest by windows, by the noise and, of enough rollouts, by these.

    Infinite where the windows say nothing: how hard a body that only turns about z is to turn about x.
    """
    each = np.arange(len(weights))
    half = student.ppf(0.975, freedom(problem, fit, weights, each)) * _errors(problem, fit, weights, each)
    half = np.maximum(half, 1.96 * np.sqrt(np.diag(expected_covariance(problem, fit, weights))))
    groups = problem.windows.rollout
    if len(np.unique(groups)) >= problem.thresholds.estimation.covariance.enough_rollouts:
        wide = student.ppf(0.975, freedom(problem, fit, weights, groups)) * _errors(problem, fit, weights, groups)
        half = np.maximum(half, wide)
    told = (weights[:, None] * fit.columns**2).sum(axis=(1, 2))
    half[np.flatnonzero(fit.scales)[told < _TOLD]] = np.inf
    return np.maximum(half, _unmodelled(fit, problem.thresholds.estimation.covariance.backlash_error))


def _unmodelled(fit: Fit, share: float) -> np.ndarray:
    """Half-widths (P,) that no data make up for: where a rotor is in its gap when a window starts is a guess."""
    out = np.zeros(len(fit.values))
    for candidate, part in zip(fit.chosen, fit.slices, strict=True):
        if candidate.effect == "backlash":
            out[part.start] = share * abs(fit.values[part.start])
    return out


def _errors(problem: Problem, fit: Fit, weights: np.ndarray, clusters: np.ndarray) -> np.ndarray:
    return np.sqrt(np.diag(covariance(problem, fit, weights, clusters)))
