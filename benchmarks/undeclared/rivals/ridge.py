"""Ridge regression of the whitened residual on the sensitivities of all parameters, its penalty by cross-validation."""

import numpy as np

from benchmarks.undeclared.rivals.common import (
    Answer,
    clip,
    effects_at,
    error_of,
    every_parameter,
    jacobian,
    named,
    residuals_of,
)
from bumblebee.diagnosis.residuals import Problem
from bumblebee.stand_in.undeclared.declared import Declared

_PENALTIES = np.logspace(-4, 4, 17)
_FOLDS = 5


def run(robot: Declared, problem: Problem, rng: np.random.Generator) -> Answer:
    """One linear step from the declared robot, shortened where the whole of it is worse."""
    parameters = every_parameter(robot)
    start, steps = np.array([p.nominal for p in parameters]), np.array([p.step for p in parameters])
    residual, columns = jacobian(problem, parameters, start)
    windows = len(problem.windows)
    shape = (len(parameters), windows, -1)
    move = steps * cross_validated(columns.reshape(shape), residual.reshape(windows, -1), rng)
    trials = [clip(parameters, start + share * move) for share in (1.0, 0.3, 0.1, 0.0)]
    costs = (residuals_of(problem, [effects_at(parameters, t) for t in trials]) ** 2).sum(axis=1)
    values = trials[int(np.argmin(costs))]
    return Answer(named(problem, parameters, values), error_of(effects_at(parameters, values)))


def cross_validated(columns: np.ndarray, residual: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Coefficients (P,) that take `residual` (W, M) away by `columns` (P, W, M); folds are whole windows."""
    scale = np.sqrt((columns**2).mean(axis=(1, 2))) + 1e-12
    design, target = columns / scale[:, None, None], -residual
    fold = rng.permutation(len(residual)) % _FOLDS
    losses = np.zeros(len(_PENALTIES))
    for k in range(_FOLDS):
        fitted, left = fold != k, fold == k
        for i, beta in enumerate(_solve(design[:, fitted], target[fitted])):
            losses[i] += ((target[left] - np.tensordot(beta, design[:, left], axes=1)) ** 2).sum()
    return _solve(design, target)[int(np.argmin(losses))] / scale


def _solve(design: np.ndarray, target: np.ndarray) -> list[np.ndarray]:
    """Coefficients for every penalty; design (P, W, M), target (W, M)."""
    flat, goal = design.reshape(len(design), -1), target.ravel()
    values, vectors = np.linalg.eigh(flat @ flat.T)
    right = vectors.T @ (flat @ goal)
    size = flat.shape[1] / len(flat)
    return [vectors @ (right / (np.maximum(values, 0) + penalty * size)) for penalty in _PENALTIES]
