"""Windows in contact restart where the readings say they began, and masses come out whole."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.dataset.session import Session, make_session
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.residuals.problem import Problem, make_problem, window_weights
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from tests.diagnosis import stander


def _made(mass: float, seed: int) -> tuple[Session, Problem, np.ndarray]:
    rollouts, heights = stander.simulate(mass, seed=seed)
    session = make_session(mujoco.MjSpec.from_string(stander.XML), rollouts, "stander", "memory")
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0, 1], 0.2, 36))
    rng = np.random.default_rng(0)
    problem = make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)
    return session, problem, heights


@pytest.fixture(scope="module")
def null() -> tuple[Session, Problem, np.ndarray]:
    """The stander as declared."""
    return _made(1.5, 0)


def test_starts_come_nearer_to_the_true_state(null: tuple) -> None:
    """The height of the base, which contact knows better than its sensor."""
    _, problem, heights = null
    true = heights[problem.windows.rollout, problem.windows.start]
    error = [np.sqrt(((w.qpos[:, 2] - true) ** 2).mean()) for w in (problem.read, problem.windows)]
    assert error[1] < 0.7 * error[0]


def test_a_complete_model_is_at_the_noise(null: tuple) -> None:
    """Mean whitened power near 1, no window far beyond it."""
    _, problem, _ = null
    fit = gauss_newton(problem, (), (), np.ones(len(problem.windows)))
    power = (fit.clean(problem) ** 2).mean(axis=1)
    assert 0.5 < power.mean() < 1.3
    assert power.max() < 3.0


def test_a_mass_in_contact_comes_out_whole() -> None:
    """In several datasets the mean size is right to within its own scatter."""
    sizes = []
    for seed in range(4):
        session, problem, _ = _made(1.9, 10 + seed)
        chosen = [
            c
            for c in all_candidates(session.plant, session.rollouts, [])
            if (c.effect, c.where) == ("link_mass", "arm") and c.start[1] == 0.0  # the truth's moments stay
        ]
        weights = window_weights(problem.residual([[]])[0])
        fit = gauss_newton(problem, chosen, chosen[0].start, weights, iterations=3, coarse=True)
        sizes.append((fit.values[0] - 1.5) / 0.4)
    error = np.std(sizes, ddof=1) / np.sqrt(len(sizes))
    assert abs(np.mean(sizes) - 1.0) < max(3 * error, 0.05)
    assert error < 0.1
