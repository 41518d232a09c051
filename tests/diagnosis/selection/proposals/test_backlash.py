"""Play is found by the few windows that feel it, and only where some window is further off than noise."""

import numpy as np
import pytest

from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.prepare import Material, gather
from bumblebee.diagnosis.residuals.problem import Problem, window_weights
from bumblebee.diagnosis.selection.proposals.backlash import backlash_trials
from bumblebee.diagnosis.selection.proposals.joint_misfit import joint_chi_squares, odd_joints
from bumblebee.diagnosis.thresholds.dataset import DatasetThresholds
from tests.diagnosis import arm
from tests.diagnosis.selection.begun import answered, state
from tests.diagnosis.strange_arm import Truth, simulate


def _material(truth: Truth) -> Material:
    session = arm.session_of(simulate(truth, seed=5))
    return gather(session, arm.SMALL, np.random.default_rng(0), lambda text: None)


def _noise(problem: Problem) -> np.ndarray:
    return np.random.default_rng(1).standard_normal(problem.nuisance.shape[1:])


def test_white_noise_has_the_chi_squares_of_its_freedom() -> None:
    problem = _material({}).problem
    own, freedom = joint_chi_squares(problem, _noise(problem))
    assert own.shape == (len(problem.windows), 3)
    error = np.sqrt(2 * freedom / own.size)
    assert own.mean() == pytest.approx(freedom, abs=4 * error)


def test_a_joints_chi_square_is_at_most_the_windows() -> None:
    problem = _material({}).problem
    noise = _noise(problem)
    assert (joint_chi_squares(problem, noise)[0] <= (noise**2).sum(axis=1, keepdims=True) + 1e-6).all()


def test_a_joint_is_odd_where_one_of_its_readings_is() -> None:
    problem = _material({}).problem
    noise = 0.7 * _noise(problem)
    assert odd_joints(problem, noise) == []
    raw = np.zeros((*noise.shape[:1], 6, problem.layout.size))
    raw[4, 3, 1] = 12 * problem.sigma[1]
    odd = odd_joints(problem, noise + problem.whitener(raw, centre=False))
    assert [name for name, _ in odd] == ["j2"] and 4 in odd[0][1]


@pytest.mark.parametrize("truth", [{}, {("backlash", "j2"): (0.006,)}])
def test_a_gap_is_tried_where_there_is_one(truth: Truth) -> None:
    """A gap of 6 mrad is less than what a first trial used to be."""
    material = _material(truth)
    problem = material.problem
    fit = gauss_newton(problem, (), (), window_weights(problem.residual([[]])[0]))
    weights = window_weights(fit.clean(problem))
    found, _ = answered(backlash_trials(state(problem, fit, material.candidates, weights)))
    if not truth:
        assert not found
        return
    assert (found[0].candidate.where, found[0].values[1]) == ("j2", 0.0)
    assert found[0].values[0] == pytest.approx(0.006, rel=0.4)


@pytest.mark.slow
def test_a_small_gap_is_named_with_an_interval_that_holds() -> None:
    """So small that the search needs steps of 1 ms, as it usually takes them."""
    rollouts = simulate({("backlash", "j2"): (0.006,)}, seed=5)
    session = arm.session_of(rollouts, thresholds=DatasetThresholds())
    found = diagnose(session, arm.SMALL).document["effects"]
    assert [(e["effect"], e["where"]) for e in found] == [("backlash", ["j2"])]
    low, high = found[0]["parameters"]["gap"]["ci95"]
    assert low <= 0.006 <= high
