"""Joint fit of the chosen effects: Gauss-Newton on whitened residuals, with the nuisances as further parameters."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t as student

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.problem import Problem
from bumblebee.diagnosis.slopes import clipped, columns_at, effects_at, taken_over
from bumblebee.sim.effects import Effect

_ENOUGH_ROLLOUTS = 6  # fewer say little about how much rollouts differ
_GAP_ERROR = 0.35  # of a gap: five came out at 57 to 93 % of their size
_TOLD = 1e-6  # chi-square of a change that matters, below which the windows say nothing of a parameter


@dataclass(frozen=True, eq=False)
class Fit:
    """Chosen candidates with their parameters, those of all of them one after the other (P,)."""

    chosen: tuple[Candidate, ...]
    values: np.ndarray
    """(P,)."""
    nuisance: np.ndarray
    """(4 or 5,) coefficients."""
    residual: np.ndarray
    """(W, M) whitened, nuisances not yet taken out."""
    columns: np.ndarray
    """(P', W, M) change of the prediction for a change of `scales`, at the fit; P' parameters that are fitted."""
    cost: float

    @property
    def effects(self) -> list[Effect]:
        """The effects at their fitted values."""
        return effects_at(self.chosen, self.values)

    @property
    def slices(self) -> list[slice]:
        """Where each candidate's parameters stand in `values`."""
        ends = np.cumsum([len(c.nominal) for c in self.chosen]).tolist()
        return [slice(end - len(c.nominal), end) for c, end in zip(self.chosen, ends, strict=True)]

    @property
    def scales(self) -> np.ndarray:
        """(P,) changes that matter; 0 for a parameter that is not fitted."""
        return np.concatenate([c.scales for c in self.chosen]) if self.chosen else np.empty(0)

    def of(self, candidate: Candidate) -> np.ndarray:
        """Parameters of one of the chosen."""
        return self.values[self.slices[self.chosen.index(candidate)]]

    def clean(self, problem: Problem) -> np.ndarray:
        """Residual without nuisances (W, M)."""
        return self.residual - np.tensordot(self.nuisance, problem.nuisance, axes=1)

    def power(self, problem: Problem) -> float:
        """Median chi-square by value of the windows, 1 for noise alone."""
        return typical_power(self.clean(problem))


def typical_power(residual: np.ndarray) -> float:
    """Median over windows of the mean square of a whitened residual (W, M)."""
    return float(np.median((residual**2).mean(axis=1)))


def project(
    problem: Problem, columns: np.ndarray, weights: np.ndarray, damping: float = 1e-9
) -> tuple[np.ndarray, np.ndarray]:
    """Basis of nuisances and columns (B, W, M) and the inverse of its weighted normal matrix (B, B).

    `damping` is Marquardt's: by what share the columns' powers are raised.
    """
    basis = np.concatenate((problem.nuisance, columns)) if len(columns) else problem.nuisance
    flat = (basis * np.sqrt(weights)[:, None]).reshape(len(basis), -1)
    normal = flat @ flat.T
    count = len(problem.nuisance)
    normal[np.arange(count), np.arange(count)] += 1.0  # the nuisances' prior
    normal[np.arange(count, len(normal)), np.arange(count, len(normal))] *= 1 + damping
    return basis, np.linalg.pinv(normal, rcond=1e-12, hermitian=True)


def solve(basis: np.ndarray, inverse: np.ndarray, residual: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Weighted least-squares coefficients (B,) of `residual` (W, M)."""
    flat = basis.reshape(len(basis), -1)
    return inverse @ (flat @ (residual * weights[:, None]).ravel())


def cost_of(problem: Problem, residual: np.ndarray, weights: np.ndarray) -> tuple[float, np.ndarray]:
    """Weighted cost of a residual at its best nuisances, and these."""
    basis, inverse = project(problem, np.empty((0, *residual.shape)), weights)
    nuisance = solve(basis, inverse, residual, weights)
    left = residual - np.tensordot(nuisance, basis, axes=1)
    return float((weights[:, None] * left**2).sum() + nuisance @ nuisance), nuisance


def resolved(problem: Problem, fit: Fit, weights: np.ndarray) -> Fit:
    """The same values with the nuisances and the cost of other nuisance columns or weights."""
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
) -> Fit:
    """Refit all chosen effects jointly, from `values` (P,); `coarse` takes the sensitivities from coarse steps.

    With `damping` (Marquardt's) what the data hardly tell stays where it is. Sensitivities of a fit that is `known` of
    the same windows are taken over where nothing near has changed, and simulated again where something near has moved.
    """
    values = clipped(chosen, np.asarray(values, dtype=float))
    residual = problem.residual([effects_at(chosen, values)])[0]
    cost, nuisance = cost_of(problem, residual, weights)
    scales = np.concatenate([c.scales for c in chosen]) if len(chosen) else np.empty(0)
    moving = np.flatnonzero(scales)
    columns, at = taken_over(problem, chosen, values, moving, known)
    columns = columns_at(problem, chosen, values, scales, coarse, columns, at)
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
            columns = columns_at(problem, chosen, values, scales, coarse, columns, at)
        if small or gained < 0.05:
            break
    return Fit(tuple(chosen), values, nuisance, residual, columns, cost)


def covariance(problem: Problem, fit: Fit, weights: np.ndarray, clusters: np.ndarray) -> np.ndarray:
    """Covariance (P, P) of the values by leaving out one cluster (W,) after the other; 0 for what is not fitted.

    The jackknife of a linear fit (CR3 of the literature on clustered data): with few clusters, or few that say much, a
    plain sandwich is too narrow, for the fit has bent to each of them.
    """
    full, scores, normals = _clustered(problem, fit, weights, clusters)
    # Pseudo-inverse: without the one cluster in which an effect acts nothing is known of it.
    rest = np.linalg.pinv(full - np.stack(normals), rcond=1e-12, hermitian=True)
    moves = np.einsum("cij,cj->ci", rest, np.stack(scores))
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
    prior[: len(problem.nuisance)] = 1.0
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
    if len(np.unique(groups)) >= _ENOUGH_ROLLOUTS:
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
    if len(np.unique(groups)) >= _ENOUGH_ROLLOUTS:
        wide = student.ppf(0.975, freedom(problem, fit, weights, groups)) * _errors(problem, fit, weights, groups)
        half = np.maximum(half, wide)
    told = (weights[:, None] * fit.columns**2).sum(axis=(1, 2))
    half[np.flatnonzero(fit.scales)[told < _TOLD]] = np.inf
    return np.maximum(half, _unmodelled(fit))


def _unmodelled(fit: Fit) -> np.ndarray:
    """Half-widths (P,) that no data make up for: where a rotor is in its gap when a window starts is a guess."""
    out = np.zeros(len(fit.values))
    for candidate, part in zip(fit.chosen, fit.slices, strict=True):
        if candidate.effect == "backlash":
            out[part.start] = _GAP_ERROR * abs(fit.values[part.start])
    return out


def _errors(problem: Problem, fit: Fit, weights: np.ndarray, clusters: np.ndarray) -> np.ndarray:
    return np.sqrt(np.diag(covariance(problem, fit, weights, clusters)))
