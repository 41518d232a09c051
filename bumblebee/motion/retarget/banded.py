"""Least squares over a trajectory: every frame meets its neighbours only, so the normal equations are banded."""

import numpy as np
from scipy.linalg import solveh_banded


class Normal:
    """Normal equations of T frames with n variables each.

    `blocks` (T, n, n) on the diagonal and (T - 1, n, n) below it; `far` (T - 2, n): two frames apart each variable
    meets itself only, by its acceleration, which keeps the band narrow.
    """

    def __init__(self, frames: int, size: int) -> None:
        self.blocks = [np.zeros((frames, size, size)), np.zeros((max(frames - 1, 0), size, size))]
        self.far = np.zeros((max(frames - 2, 0), size))
        self.slope = np.zeros((frames, size))
        self.cost = 0.0

    def add(self, jacobian: np.ndarray, residual: np.ndarray, weight: np.ndarray) -> None:
        """Residuals (T, m) of one frame each, with (T, m, n) and weights (T, m)."""
        self.cost += float((weight * np.square(residual)).sum())
        weighted = jacobian * weight[..., None]
        self.blocks[0] += weighted.transpose(0, 2, 1) @ jacobian
        self.slope += np.einsum("tmn,tm->tn", weighted, residual)

    def add_change(self, jacobian: np.ndarray, residual: np.ndarray, weight: np.ndarray) -> None:
        """Residuals (T - 1, m) that are changes of something with (T, m, n) from one frame to the next."""
        self.cost += float((weight * np.square(residual)).sum())
        before, after = jacobian[:-1] * weight[..., None], jacobian[1:] * weight[..., None]
        self.blocks[0][:-1] += before.transpose(0, 2, 1) @ jacobian[:-1]
        self.blocks[0][1:] += after.transpose(0, 2, 1) @ jacobian[1:]
        self.blocks[1] -= after.transpose(0, 2, 1) @ jacobian[:-1]
        self.slope[:-1] -= np.einsum("tmn,tm->tn", before, residual)
        self.slope[1:] += np.einsum("tmn,tm->tn", after, residual)

    def add_differences(self, order: int, residual: np.ndarray, weight: np.ndarray) -> None:
        """Residuals (T - order, n): differences of each variable over 1 or 2 steps; weights (n,) or (T - order, n)."""
        signs = (-1.0, 1.0) if order == 1 else (1.0, -2.0, 1.0)
        rows, size = residual.shape
        weight = np.broadcast_to(weight, residual.shape)
        self.cost += float((weight * np.square(residual)).sum())
        each = np.arange(size)
        for i, one in enumerate(signs):
            self.slope[i : i + rows] += one * weight * residual
            for k, other in enumerate(signs[: i + 1]):
                if i - k == 2:
                    self.far += one * other * weight
                else:
                    self.blocks[i - k][k : k + rows, each, each] += one * other * weight

    def solve(self, damping: np.ndarray) -> np.ndarray:
        """The step (T, n) that lowers the sum of squares, each variable held back by `damping` (n,)."""
        frames, size = self.slope.shape
        band = np.zeros((frames, size, 2 * size + 1))  # of each column the values from the diagonal down, as LAPACK's
        for column in range(size):
            band[:, column, : size - column] = self.blocks[0][:, column:, column]
            band[: frames - 1, column, size - column : 2 * size - column] = self.blocks[1][:, :, column]
        band[: len(self.far), :, 2 * size] = self.far
        band[:, :, 0] += damping
        lower = band.reshape(frames * size, -1).T
        step = solveh_banded(lower, self.slope.ravel(), lower=True, overwrite_ab=True, check_finite=False)
        return -step.reshape(frames, size)
