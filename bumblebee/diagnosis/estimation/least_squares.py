"""Weighted linear least squares over nuisances and sensitivities."""

import numpy as np

from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.residuals import Problem


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
    normal[np.arange(count), np.arange(count)] += problem.prior
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
    return float((weights[:, None] * left**2).sum() + problem.prior * nuisance @ nuisance), nuisance


class LeftOver:
    """Costs of residuals, nuisances and chosen effects free to move linearly."""

    def __init__(self, problem: Problem, fit: Fit, weights: np.ndarray) -> None:
        self._basis, self._inverse = project(problem, fit.columns, weights)
        self.weights = weights

    def left(self, residual: np.ndarray) -> np.ndarray:
        """Part of a residual (W, M) that is left."""
        move = solve(self._basis, self._inverse, residual, self.weights)
        return residual - np.tensordot(move, self._basis, axes=1)

    def cost(self, residual: np.ndarray) -> float:
        """Weighted square of what is left of a residual (W, M)."""
        left = self.left(residual)
        return float((self.weights[:, None] * left**2).sum())
