"""The banded normal equations against dense least squares."""

import numpy as np
import pytest

from bumblebee.motion.retarget.banded import Normal

T, N = 7, 3


def _dense(rows: list[tuple[np.ndarray, np.ndarray, np.ndarray]], damping: np.ndarray) -> np.ndarray:
    """Rows of (Jacobian (m, T * N), residual (m,), weight (m,)): the damped Gauss-Newton step (T, N)."""
    matrix = np.diag(np.tile(damping, T))
    slope = np.zeros(T * N)
    for jacobian, residual, weight in rows:
        matrix += jacobian.T @ (weight[:, None] * jacobian)
        slope += jacobian.T @ (weight * residual)
    return -np.linalg.solve(matrix, slope).reshape(T, N)


def _single(jacobian: np.ndarray) -> np.ndarray:
    """(T, m, N) as (T * m, T * N)."""
    wide = np.zeros((T, jacobian.shape[1], T, N))
    for t in range(T):
        wide[t, :, t] = jacobian[t]
    return wide.reshape(-1, T * N)


def _difference(order: int) -> np.ndarray:
    rows = np.diff(np.eye(T), order, axis=0)
    return np.kron(rows, np.eye(N))


def test_all_terms_together_are_the_dense_solution_and_its_cost():
    rng = np.random.default_rng(1)
    one, change = rng.normal(size=(T, 4, N)), rng.normal(size=(T, 2, N))
    r1, w1 = rng.normal(size=(T, 4)), rng.uniform(0.1, 2, (T, 4))
    r2, w2 = rng.normal(size=(T - 1, 2)), rng.uniform(0.1, 2, (T - 1, 2))
    r3, w3 = rng.normal(size=(T - 1, N)), rng.uniform(0.1, 2, (T - 1, N))
    r4, w4 = rng.normal(size=(T - 2, N)), rng.uniform(0.1, 2, N)
    normal = Normal(T, N)
    normal.add(one, r1, w1)
    normal.add_change(change, r2, w2)
    normal.add_differences(1, r3, w3)
    normal.add_differences(2, r4, w4)
    wide = _single(change).reshape(T, 2, T * N)
    rows = [
        (_single(one), r1.ravel(), w1.ravel()),
        (np.diff(wide, axis=0).reshape(-1, T * N), r2.ravel(), w2.ravel()),
        (_difference(1), r3.ravel(), w3.ravel()),
        (_difference(2), r4.ravel(), np.tile(w4, T - 2)),
    ]
    damping = rng.uniform(0.1, 1, N)
    np.testing.assert_allclose(normal.solve(damping), _dense(rows, damping), atol=1e-9)
    assert normal.cost == pytest.approx(sum(float((w * r * r).sum()) for _, r, w in rows))


def test_more_damping_makes_a_smaller_step():
    normal = Normal(T, N)
    normal.add(np.tile(np.eye(N), (T, 1, 1)), np.ones((T, N)), np.ones((T, N)))
    sizes = [np.abs(normal.solve(np.full(N, d))).max() for d in (0.0, 1.0, 9.0)]
    assert sizes == pytest.approx([1.0, 0.5, 0.1])


def test_the_step_solves_a_linear_problem_at_once():
    rng = np.random.default_rng(2)
    jacobian, truth = rng.normal(size=(T, 5, N)), rng.normal(size=(T, N))
    normal = Normal(T, N)
    normal.add(jacobian, -np.einsum("tmn,tn->tm", jacobian, truth), np.ones((T, 5)))
    np.testing.assert_allclose(normal.solve(np.zeros(N)), truth, atol=1e-9)
