"""Screening: torque answers stand for simulated sensitivities; score tests keep their level on simulated noise."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.candidates.signal_scales import scales_of
from bumblebee.diagnosis.candidates.traits import SATURATIONS
from bumblebee.diagnosis.dataset.session import make_session
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.residuals.problem import Problem, make_problem
from bumblebee.diagnosis.residuals.whitening import null_draws
from bumblebee.diagnosis.selection.score_tests import null_maxima, score_tests
from bumblebee.diagnosis.sensitivities.columns import Columns, pulse_sizes, screen
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from bumblebee.sim.effects import CATALOGUE
from tests.diagnosis import arm


@pytest.fixture(scope="module")
def made() -> tuple[Problem, list[Candidate], Columns]:
    """A null dataset of the arm, a few windows of it and the columns of all candidates."""
    session = make_session(mujoco.MjSpec.from_string(arm.XML), arm.simulate({}, count=2, seconds=3.0), "arm", "memory")
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0], 0.2, 14))
    rng = np.random.default_rng(0)
    problem = make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)
    candidates = all_candidates(session.plant, session.rollouts, [])
    few = [c for c in candidates if c.effect != "cogging" or c.step[2] in (3, 12)]
    torque = scales_of(session.plant, session.rollouts).torque
    return problem, few, screen(problem, few, [], pulse_sizes(problem, torque))[0]


def test_columns_of_torque_answers_are_those_of_simulations(made: tuple) -> None:
    """Same direction and size for every effect that is a torque and that these data feel."""
    problem, candidates, columns = made
    kinds = [c for c in candidates if CATALOGUE[c.effect].column != "simulated" and c.effect not in SATURATIONS]
    simulated, first = problem.sensitivities(kinds), 0
    cosines = {}
    for c in kinds:
        rows = columns.slices[columns.candidates.index(c)]
        for k, row in enumerate(range(rows.start, rows.stop)):
            a, b = columns.values[row].ravel(), simulated[first + k].ravel()
            if np.linalg.norm(b) > 5.0:
                cosines[c.effect, c.where, k] = a @ b / np.linalg.norm(a) / np.linalg.norm(b)
        first += len(c.free)
    assert len({effect for effect, _, _ in cosines}) >= 14
    assert np.median(list(cosines.values())) > 0.98
    # Stribeck's fall-off is the sharpest in time: five pulses a window follow it least well.
    assert min(cosines.values()) > 0.6


def test_noise_alone_seldom_passes_the_bound(made: tuple) -> None:
    """The largest z over all candidates on simulated null datasets is that of as many normal draws, roughly."""
    problem, _, columns = made
    fit = gauss_newton(problem, (), (), np.ones(len(problem.windows)))
    draws = null_draws(problem.whitener, problem.sigma, np.random.default_rng(1))
    assert 0.7 < (draws**2).mean() < 1.3
    maxima = null_maxima(problem, columns, fit, np.ones(len(problem.windows)), draws)
    assert 1.5 < np.median(maxima) < 4.0


def test_a_score_test_estimates_the_step(made: tuple) -> None:
    """A residual that is 0.7 columns of one candidate tests as 0.7 steps of it, and as nothing beside it."""
    problem, _, columns = made
    k = next(i for i, c in enumerate(columns.candidates) if (c.effect, c.where) == ("motor_strength", "j2"))
    weights = np.ones(len(problem.windows))
    fit = gauss_newton(problem, (), (), weights)
    rng = np.random.default_rng(0)
    residual = 0.7 * columns.values[columns.slices[k]][0] + 0.01 * rng.standard_normal(fit.residual.shape)
    tests = score_tests(problem, columns, replace(fit, residual=residual), weights)
    assert tests.steps[k][0] == pytest.approx(0.7, abs=0.02)
    beside = replace(fit, residual=residual, columns=columns.values[columns.slices[k]])
    assert abs(score_tests(problem, columns, beside, weights).gain[k]) < 1.0


def test_late_drives_and_encoders_have_columns_like_those_of_simulations(
    made: tuple, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a simulation too, as robots of many joints have them: to first order a torque and a start that moved."""
    problem, candidates, columns = made
    late = [c for c in candidates if CATALOGUE[c.effect].column == "late" and c.where]
    monkeypatch.setattr("bumblebee.diagnosis.sensitivities.columns.is_simulated", lambda c, joints: False)
    torque = scales_of(problem.plant, problem.windows.source).torque
    first_order = screen(problem, late, [], pulse_sizes(problem, torque))[0].values
    for c, ours in zip(late, first_order, strict=True):
        simulated = columns.values[columns.slices[columns.candidates.index(c)]][0]
        cosine = (ours * simulated).sum() / np.linalg.norm(ours) / np.linalg.norm(simulated)
        light = c.where == "j3"  # its servo stops it within the lag: pulses of 40 ms follow that least well
        assert cosine > (0.5 if light else 0.8), (c.effect, c.where, cosine)
