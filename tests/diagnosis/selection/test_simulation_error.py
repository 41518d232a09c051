"""Values where the model is far from the noise: those that predict best, and nothing near the noise."""

import numpy as np
import pytest

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.comparison import Holdout
from bumblebee.diagnosis.estimation import gauss_newton
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.diagnosis.selection.final_fit import Refined, half_widths
from bumblebee.diagnosis.selection.simulation_error import in_signal_units, least_simulation_error, signal_errors
from tests.diagnosis import arm
from tests.diagnosis.strange_arm import simulate

FRICTION, COGGING = ("viscous_friction", "j2"), ("cogging", "j2")


def _problems(noise: float, cogging: float) -> tuple[Problem, Holdout, dict[tuple[str, str], Candidate]]:
    """Windows of two rollouts to fit and of two to judge; candidates by effect and place."""
    truth = {FRICTION: (0.3,)} | ({COGGING: (cogging, 0.0, 9.0)} if cogging else {})
    session = arm.session_of(simulate(truth, seed=3, noise=noise))
    fitted, judging = arm.problem_of(session, [0, 1], 20), arm.problem_of(session, [2, 3], 20)
    candidates = {(c.effect, c.where): c for c in all_candidates(session.plant, session.rollouts, [])}
    return fitted, Holdout(judging), candidates


def _fit(problem: Problem, chosen: list[Candidate], start: list[float]) -> Refined:
    weights = window_weights(problem.residual([[]])[0])
    fit = gauss_newton(problem, chosen, start, weights, iterations=6)
    return Refined(problem, fit, weights, half_widths(problem, fit, weights))


def test_near_the_noise_the_last_fit_stays_as_it_is() -> None:
    problem, holdout, candidates = _problems(1.0, 0.0)
    last = _fit(problem, [candidates[FRICTION]], [0.3])
    assert last.fit.power(problem) < 2
    assert least_simulation_error(last, holdout) is last


def test_far_from_the_noise_values_predict_the_readings_better() -> None:
    problem, holdout, candidates = _problems(0.1, 0.6)
    last = _fit(problem, [candidates[FRICTION]], [0.3])
    assert last.fit.power(problem) > problem.thresholds.selection.simulation_error.far
    found = least_simulation_error(last, holdout)
    assert found is not last
    assert found.fit.chosen == last.fit.chosen
    assert np.isfinite(found.half).all()
    size = signal_errors(problem, last.fit)
    for each in (problem, holdout.problem):
        plain = in_signal_units(each, size)
        before, after = ((r**2).mean() for r in plain.residual([last.fit.effects, found.fit.effects]))
        assert after < before


def test_readings_in_signal_units_are_the_simulations_own_errors() -> None:
    problem, _, candidates = _problems(1.0, 0.0)
    last = _fit(problem, [candidates[FRICTION]], [0.3])
    plain = in_signal_units(problem, np.ones(len(problem.sigma)))
    raw = plain.residual([last.fit.effects])[0]
    white = np.matmul(problem.whitener.factor, (raw - problem.whitener.offset)[..., None])[..., 0]
    assert white == pytest.approx(problem.residual([last.fit.effects])[0], abs=1e-6)


def test_without_windows_to_judge_by_nothing_is_moved() -> None:
    problem, _, candidates = _problems(0.1, 0.6)
    last = _fit(problem, [candidates[FRICTION]], [0.3])
    assert least_simulation_error(last, Holdout(None)) is last
