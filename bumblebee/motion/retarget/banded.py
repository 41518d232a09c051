"""Least squares over a trajectory: every frame meets its neighbours only, so the normal equations are banded."""

import numpy as np
from scipy.linalg import solveh_banded

REACH = 2
"""How many frames apart two variables may meet: an acceleration spans three."""


class Normal:
    """Normal equations of T frames with n variables each: blocks (T, n, n) on the diagonal and on the two below it."""

    def __init__(self, frames: int, size: int) -> None:
        self.blocks = [np.zeros((frames - lag, size, size)) for lag in range(min(REACH, frames - 1) + 1)]
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
                self.blocks[i - k][k : k + rows, each, each] += one * other * weight

    def solve(self, damping: np.ndarray) -> np.ndarray:
        """The step (T, n) that lowers the sum of squares, each variable held back by `damping` (n,)."""
        frames, size = self.slope.shape
        band = np.zeros(((REACH + 1) * size, frames * size))
        row, column = np.indices((size, size))
        for lag, block in enumerate(self.blocks):
            below = lag * size + row - column
            keep = below >= 0
            start = np.arange(len(block))[:, None] * size
            band[below[keep], start + column[keep]] = block[:, row[keep], column[keep]]
        band[0] += np.tile(damping, frames)
        return -solveh_banded(band, self.slope.ravel(), lower=True, overwrite_ab=True, check_finite=False).reshape(
            frames, size
        )
