"""Nuisances stay what they are, differences of a millisecond, also where the model is far from the data."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.diagnosis.dataset.session import Session
from bumblebee.diagnosis.estimation.least_squares import cost_of
from bumblebee.diagnosis.residuals.problem import Problem, make_problem
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from tests.diagnosis import arm


@pytest.fixture(scope="module")
def problem() -> Problem:
    """Windows of an arm that lacks much friction."""
    rollouts = arm.simulate({("coulomb_friction", joint): 2.0 for joint in arm.JOINTS}, count=2, seconds=3.0)
    session: Session = arm.session_of(rollouts)
    windows = cut(session.plant, session.layout, rollouts, choose_starts(rollouts, [0, 1], 0.2, 20))
    rng = np.random.default_rng(0)
    return make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)


def test_the_prior_weighs_as_what_is_left_does_and_never_less_than_by_the_noise(problem: Problem) -> None:
    rule = problem.thresholds.residuals.nuisances.held_from
    assert problem.prior == problem.held_to(0.5).prior == problem.held_to(rule).prior == 1.0
    assert problem.held_to(100.0 * rule).prior == pytest.approx(100.0)


def test_a_missing_effect_moves_nuisances_less_where_the_model_is_far_off(problem: Problem) -> None:
    ones = np.ones(len(problem.windows))
    residual = problem.residual([[]])[0]
    power = float(np.median((residual**2).mean(axis=1)))
    assert power > 10.0
    free, held = cost_of(problem, residual, ones)[1], cost_of(problem.held_to(power), residual, ones)[1]
    assert np.linalg.norm(held) < 0.9 * np.linalg.norm(free)
    noise = residual / np.sqrt(power)
    same, own = cost_of(problem, noise, ones), cost_of(replace(problem, prior=1.0), noise, ones)
    assert same[0] == own[0]
