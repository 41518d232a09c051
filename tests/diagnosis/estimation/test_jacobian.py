"""Sensitivities are simulated where something near has moved, and taken over where not; large models in two steps."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.dataset.session import Session, make_session
from bumblebee.diagnosis.estimation.covariance import interval
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.estimation.jacobian import taken_over
from bumblebee.diagnosis.residuals.problem import Problem, make_problem, window_weights
from bumblebee.diagnosis.simulation.cache import Changes
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from bumblebee.diagnosis.thresholds.dataset import DatasetThresholds, TimeSteps
from bumblebee.sim.effects import Effect, single
from tests.diagnosis import arm

FRICTION, LATE = 0.25, 0.012


@pytest.fixture(scope="module")
def session() -> Session:
    """The arm with dry friction on one joint and late commands on another."""
    truth = {("coulomb_friction", "j2"): FRICTION, ("command_delay", "j1"): LATE}
    return make_session(mujoco.MjSpec.from_string(arm.XML), arm.simulate(truth, count=2, seconds=3.0), "arm", "memory")


@pytest.fixture(scope="module")
def problem(session: Session) -> Problem:
    """Some windows of it."""
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0, 1], 0.2, 16))
    rng = np.random.default_rng(0)
    return make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)


def _candidate(session: Session, effect: str, where: str) -> Candidate:
    every = all_candidates(session.plant, session.rollouts, [])
    return next(c for c in every if (c.effect, c.where) == (effect, where))


def test_a_known_fit_gives_the_columns_of_other_places_and_the_result_stays(session: Session, problem: Problem) -> None:
    late, friction = (_candidate(session, *x) for x in (("command_delay", "j1"), ("coulomb_friction", "j2")))
    ones = np.ones(len(problem.windows))
    first = gauss_newton(problem, (late,), (LATE,), ones)
    start = np.append(first.values, 0.8 * FRICTION)
    alone = gauss_newton(problem, (late, friction), start, ones)
    with_it = gauss_newton(problem, (late, friction), start, ones, known=first)
    columns, at = taken_over(problem, (late, friction), start, np.arange(2), first)
    assert np.array_equal(columns[0], first.columns[0])
    assert np.isfinite(at[0]).all()
    assert np.isnan(at[1]).all()
    assert np.abs(with_it.values - alone.values).max() < 0.02 * FRICTION
    assert with_it.cost == pytest.approx(alone.cost, rel=1e-3)


def test_columns_of_the_same_joint_are_not_taken_over(session: Session, problem: Problem) -> None:
    friction, damping = (_candidate(session, x, "j2") for x in ("coulomb_friction", "viscous_friction"))
    ones = np.ones(len(problem.windows))
    first = gauss_newton(problem, (friction,), (FRICTION,), ones, iterations=0)
    _, at = taken_over(problem, (friction, damping), np.array([FRICTION, 0.1]), np.arange(2), first)
    assert np.isnan(at).all()


def _friction(where: str, size: float) -> Effect:
    return single("coulomb_friction", where, size)


def test_changes_are_simulated_again_only_where_something_near_has_changed(problem: Problem) -> None:
    asked: list[int] = []

    def simulate() -> np.ndarray:
        asked.append(1)
        return np.full((2, 3), float(len(asked)))

    known = Changes().on(problem.windows, problem.whitener)
    assert known.get([], "j1", ("limit", 3.0), simulate).max() == 1
    assert known.get([_friction("j2", 0.2)], "j1", ("limit", 3.0), simulate).max() == 1
    assert known.taken
    assert known.get([_friction("j1", 0.2)], "j1", ("limit", 3.0), simulate).max() == 2
    assert known.get([_friction("j1", 0.2001)], "j1", ("limit", 3.0), simulate).max() == 2
    assert known.get([_friction("j1", 0.3)], "j1", ("limit", 3.0), simulate).max() == 3
    assert known.get([single("command_delay", "", 0.01)], "j1", ("limit", 3.0), simulate).max() == 4
    assert known.get([_friction("j2", 0.2)], "j1", ("limit", 3.0), simulate, fresh=True).max() == 5
    assert known.get([_friction("j2", 0.2)], "j1", ("limit", 2.0), simulate).max() == 6
    part = problem.part(np.arange(4))
    assert known.on(part.windows, part.whitener).get([], "j1", ("limit", 3.0), simulate).max() == 7


def test_effects_everywhere_count_as_near_to_what_is_everywhere(problem: Problem) -> None:
    asked: list[int] = []

    def simulate() -> np.ndarray:
        asked.append(1)
        return np.zeros((2, 3))

    known = Changes().on(problem.windows, problem.whitener)
    for effects in ([], [_friction("j2", 0.2)], [_friction("j2", 0.3)]):
        known.get(effects, "", ("delay",), simulate)
    assert len(asked) == 3


def test_small_models_are_searched_in_the_steps_of_the_last_fit(session: Session, problem: Problem) -> None:
    assert session.search_step == session.steps[0] == problem.fine == problem.between
    assert problem.finely().fine == problem.finest


def test_large_models_are_searched_in_longer_steps_and_fitted_in_short_ones() -> None:
    rollouts = arm.simulate({("coulomb_friction", "j2"): FRICTION}, count=2, seconds=3.0)
    rules = DatasetThresholds(time_steps=TimeSteps(small_model=2))
    session = make_session(mujoco.MjSpec.from_string(arm.XML), rollouts, "arm", "memory", thresholds=rules)
    assert (session.steps[0], session.search_step) == pytest.approx((0.001, 0.002))
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0, 1], 0.2, 16))
    steps, rng = (session.search_step, session.steps[1]), np.random.default_rng(0)
    problem = make_problem(session.plant, session.layout, windows, session.sigma, steps, [], rng, session.steps[0])
    assert problem.finely().fine == pytest.approx(0.001)
    friction = _candidate(session, "coulomb_friction", "j2")
    found = []
    for one in (problem, problem.finely()):
        weights = window_weights(one.residual([[_friction("j2", FRICTION)]])[0])
        found.append(gauss_newton(one, (friction,), (0.8 * FRICTION,), weights).values[0])
    assert found[0] == pytest.approx(found[1], rel=0.01)
    assert found[1] == pytest.approx(FRICTION, rel=0.1)


def test_both_sides_of_a_difference_are_simulated_in_one_step(problem: Problem) -> None:
    longer = replace(problem, between=2 * problem.fine)
    moved = [[_friction("j2", 0.2)]]
    assert np.array_equal(longer.differences([], [[]], coarse=False), np.zeros((1, *problem.nuisance.shape[1:])))
    near, far = (p.differences([], moved, coarse=False) for p in (problem, longer))
    assert 0 < np.abs(near - far).max() < 0.05 * np.abs(near).max()


def test_moments_stay_what_a_body_can_have_and_keep_their_intervals(session: Session, problem: Problem) -> None:
    """A moment beyond the sum of the others is brought back, and there its sensitivity is taken downwards, not as zero.

    A torso's xx of 0.29 kg m^2 beside 0.17 and 0.04 had been reported with an interval of no width.
    """
    inertia = _candidate(session, "link_inertia", "l3")
    fit = gauss_newton(problem, (inertia,), (0.009, 0.005, 0.001), np.ones(len(problem.windows)), iterations=0)
    assert fit.values[0] == pytest.approx(0.006, rel=1e-3)
    assert fit.values[1:] == pytest.approx([0.005, 0.001])
    assert (np.abs(fit.columns).max(axis=(1, 2)) > 0).all()
    assert (interval(problem, fit, window_weights(fit.clean(problem))) > 0).all()


def test_no_link_shrinks_to_a_point(session: Session, problem: Problem) -> None:
    """Moments stop at a hundredth of the declared ones, where every one of them still shows in the windows."""
    inertia = _candidate(session, "link_inertia", "l3")
    fit = gauss_newton(problem, (inertia,), (1e-9, 1e-9, 1e-9), np.ones(len(problem.windows)), iterations=0)
    assert fit.values == pytest.approx(0.01 * np.array(inertia.nominal), rel=0.3)
    assert (np.abs(fit.columns).max(axis=(1, 2)) > 0).all()
