"""Windows of rollouts as the diagnosis sees them, and the error that every method is judged by."""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.residuals import Problem, make_problem
from bumblebee.diagnosis.simulation import choose_starts, cut

HORIZON = 0.2  # [s]


def problem_of(session: Session, ids: Sequence[int], budget: int, sigma: np.ndarray, seed: int = 0) -> Problem:
    """At most `budget` windows of the rollouts `ids`, whitened for sensors of noise `sigma` (D,)."""
    starts = choose_starts(session.rollouts, list(ids), HORIZON, budget)
    windows = cut(session.plant, session.layout, session.rollouts, starts)
    return make_problem(session.plant, session.layout, windows, sigma, session.steps, [], np.random.default_rng(seed))


def error_of(problem: Problem, residual: np.ndarray) -> float:
    """Root mean square of a whitened residual (W, M), less what two correct simulators differ in.

    The directions in which another integrator, step or servo clock shows (`problem.nuisance`) are fitted and taken out
    for every method alike: the truth runs at 1 ms with another integrator, and to undo that is nobody's task here.
    """
    columns = problem.nuisance.reshape(len(problem.nuisance), -1).astype(float)
    flat = residual.ravel()
    shares = np.linalg.lstsq(columns @ columns.T + 1e-9 * np.eye(len(columns)), columns @ flat, rcond=None)[0]
    return float(np.sqrt(((flat - shares @ columns) ** 2).mean()))
