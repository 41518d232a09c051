"""Intervals cover: fits of the true effect alone over several datasets, against their own standard errors."""

import copy
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.estimation.covariance import interval
from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.estimation.integrator_error import moves
from bumblebee.diagnosis.report.effect_entries import _parameters
from bumblebee.diagnosis.residuals.problem import Problem, make_problem, window_weights
from bumblebee.diagnosis.selection import final_fit as refining
from bumblebee.diagnosis.selection.final_fit import refine
from bumblebee.diagnosis.simulation import residuals, vary
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from bumblebee.errors import BadInput
from tests.diagnosis import arm

SEEDS = 5


def _fitted(kind: str, place: str, value: float, seed: int) -> tuple[Problem, Fit, np.random.Generator]:
    """The true effect alone, fitted to 24 windows of three rollouts."""
    rollouts = arm.simulate({(kind, place): value} if value else {}, count=3, seconds=4.0, seed=seed)
    session = arm.session_of(rollouts)
    starts = choose_starts(session.rollouts, [0, 1, 2], 0.2, 24)
    windows = cut(session.plant, session.layout, session.rollouts, starts)
    rng = np.random.default_rng(0)
    problem = make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)
    chosen = [c for c in all_candidates(session.plant, session.rollouts, []) if (c.effect, c.where) == (kind, place)]
    return problem, gauss_newton(problem, chosen[:1], chosen[0].start, window_weights(problem.residual([[]])[0])), rng


@pytest.mark.parametrize(("kind", "place", "value"), [("command_delay", "j2", 0.013), ("viscous_friction", "j1", 0.3)])
def test_errors_are_as_large_as_their_intervals_say(kind: str, place: str, value: float) -> None:
    """No z = error / (half-width / 1.96) is beyond 3.5, their mean is near 0 and their spread near 1."""
    z = []
    for seed in range(SEEDS):
        problem, fit, rng = _fitted(kind, place, value, 100 + seed)
        last = refine(problem, fit, rng)
        z.append(1.96 * (last.fit.values[0] - value) / last.half[0])
    assert np.abs(z).max() < 3.5
    assert abs(np.mean(z)) < 1.5
    assert np.std(z) < 2.0


def test_a_limit_comes_out_the_same_from_wherever_the_search_left_it() -> None:
    """Windows weigh and are whitened by the fit itself: from far off and from nearby the last fit ends in one place."""
    problem, fit, _ = _fitted("torque_limit", "j2", 4.0, 100)
    ends = []
    for start in (3.9, 5.0):
        begun = gauss_newton(problem, fit.chosen, [start], window_weights(fit.clean(problem)), iterations=0)
        ends.append(refine(problem, begun, np.random.default_rng(0)))
    assert abs(ends[0].fit.values[0] - ends[1].fit.values[0]) < ends[1].half[0]
    assert ends[1].fit.values[0] == pytest.approx(4.0, rel=0.02)


def test_what_another_integrator_would_find_is_within_the_interval() -> None:
    """To first order, beside the nuisances; the interval is the wider for it."""
    problem, fit, rng = _fitted("viscous_friction", "j1", 0.3, 100)
    last = refine(problem, fit, rng)
    move = moves(last.problem, last.fit, last.weights)
    assert 0 < move[0] < last.half[0]
    plain = interval(last.problem, last.fit, last.weights)
    assert last.half == pytest.approx(np.hypot(plain, 1.96 * move))


@pytest.mark.parametrize("kv", [24, 32])
def test_an_explicit_servo_that_shakes_is_no_other_simulator(kv: float) -> None:
    """A stiff damper on a light link: explicit steps of 1 ms swing it, and stay finite in windows of 0.2 s."""
    stiff = arm.XML.replace('kp="30" kv="2" forcerange="-20 20"', f'kp="60" kv="{kv}" forcerange="-5000 5000"')
    rollouts = arm.simulate({("coulomb_friction", "j2"): 0.6}, count=3, seconds=4.0, seed=100)
    session = arm.session_of(rollouts, stiff)
    problem = arm.problem_of(session, [0, 1, 2], 24)
    every = all_candidates(session.plant, session.rollouts, [])
    chosen = [next(c for c in every if (c.effect, c.where) == ("coulomb_friction", "j2"))]
    weights = window_weights(problem.residual([[]])[0])
    fit = gauss_newton(problem, chosen, [0.6], weights)
    explicit = copy.copy(vary(problem.plant, fit.effects).model)
    explicit.opt.integrator = int(mujoco.mjtIntegrator.mjINT_EULER)
    model = replace(vary(problem.plant, fit.effects), model=explicit)
    raw = residuals(problem.plant, problem.layout, problem.windows, [model], problem.fine)[0]
    assert np.isfinite(raw).all()
    swung = ((problem.whitener(raw) - fit.residual) ** 2).mean(axis=1)
    assert np.mean(swung > 1e3) > 0.4
    assert moves(problem, fit, weights)[0] < 0.05


@pytest.mark.parametrize("kind", ["backlash", "series_elasticity"])
def test_a_model_with_joints_of_its_own_is_asked_of_other_integrators_too(kind: str) -> None:
    """Gaps and shafts have coordinates that no log has."""
    session = arm.session_of(arm.simulate({}, count=2, seconds=4.0))
    problem = arm.problem_of(session, [0, 1], 12)
    chosen = [next(c for c in all_candidates(session.plant, session.rollouts, []) if c.effect == kind)]
    fit = gauss_newton(problem, chosen, chosen[0].moved(0, 1.0), np.ones(12), iterations=0)
    assert vary(problem.plant, fit.effects).model.nq > session.plant.model.nq
    assert np.isfinite(moves(problem, fit, np.ones(12))).all()


def test_what_the_windows_say_nothing_of_has_no_end() -> None:
    """The first body turns about z alone: its moments about x and y are unknown, and null in what is written."""
    problem, fit, _ = _fitted("link_inertia", "l1", 0.0, 100)
    half = interval(problem, fit, window_weights(fit.clean(problem)))
    assert np.isinf(half[:2]).all()
    assert 0 < half[2] < 0.01
    written = _parameters(problem.plant, fit.chosen[0], fit.values, half)
    assert [written[name]["ci95"][1] for name in ("xx", "yy")] == [None, None]
    assert written["zz"]["ci95"][1] == pytest.approx(fit.values[2] + half[2])


def test_a_fit_whose_noisy_starts_diverge_keeps_its_whitening(monkeypatch) -> None:
    """Windows that are finite may diverge from starts moved by noise: the fit goes on as it was whitened."""
    problem, fit, rng = _fitted("coulomb_friction", "j2", 1.0, 100)

    def diverging(*args: object, **settings: object) -> Problem:
        raise BadInput("declared model, 40 of 40 windows", "simulations that stay finite", "simulations that diverge")

    monkeypatch.setattr(refining, "make_problem", diverging)
    last = refine(problem, fit, rng)
    assert last.problem.whitener is problem.whitener
    assert last.fit.values[0] == pytest.approx(1.0, rel=0.05)
