"""A tilt of the base's sensor comes out whole where feet touch the floor, and nothing of it where there is none."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.dataset.session import make_session
from bumblebee.diagnosis.estimation.covariance import interval
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.residuals.problem import Problem, make_problem, window_weights
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from bumblebee.quaternions import from_rotation_vector, multiply
from bumblebee.sim.effects import Effect, single
from tests.diagnosis import stander

TILT = np.array([0.008, -0.004, 0.0])


def made(tilt: np.ndarray, seed: int, effects: tuple[Effect, ...] = ()) -> tuple[Problem, Candidate]:
    """Windows of a stander whose sensor is mounted at an angle (3,) [rad], whitened with `effects`."""
    turn = from_rotation_vector(tilt)
    rollouts = [replace(r, base_quat=multiply(r.base_quat, turn)) for r in stander.simulate(seed=seed)[0]]
    session = make_session(mujoco.MjSpec.from_string(stander.XML), rollouts, "stander", "memory")
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0, 1], 0.2, 36))
    rng = np.random.default_rng(0)
    problem = make_problem(session.plant, session.layout, windows, session.sigma, session.steps, effects, rng)
    every = all_candidates(session.plant, session.rollouts, [])
    return problem, next(c for c in every if c.effect == "imu_offset")


def fitted(tilt: np.ndarray, seed: int, effects: tuple[Effect, ...] = ()) -> tuple[np.ndarray, np.ndarray]:
    """The tilt that comes out (2,) [rad] and its interval's half-width."""
    problem, candidate = made(tilt, seed, effects)
    weights = window_weights(problem.residual([[]])[0])
    fit = gauss_newton(problem, (candidate,), (0.0, 0.0), weights)
    return fit.values, interval(problem, fit, weights)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_tilt_comes_out_whole(seed: int) -> None:
    values, half = fitted(TILT, seed)
    assert np.abs(values - TILT[:2]).max() < 1.5 * half.max()
    assert half.max() < 0.0015


def test_a_level_sensor_has_none() -> None:
    values, half = fitted(np.zeros(3), 4)
    assert (np.abs(values) < 1.5 * half).all()


def test_windows_whitened_with_a_tilt_give_the_same() -> None:
    """Around the true tilt and around none: the linear residuals agree, and both have the declared model's at none."""
    there = (single("imu_offset", "trunk", *TILT[:2]),)
    plain, tilted = fitted(TILT, 1)[0], fitted(TILT, 1, there)[0]
    np.testing.assert_allclose(plain, tilted, atol=6e-4)
    problem, _ = made(TILT, 1, there)
    level, own = problem.residual([[], list(there)])
    assert (own**2).mean() < 0.8 * (level**2).mean()
    assert problem.tilted(list(there)) is None
    np.testing.assert_allclose(level - own, problem.tilted([]), atol=1e-9)
