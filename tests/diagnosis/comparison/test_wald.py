"""Acceptance: an effect found in its own direction, and no integrator's."""

from dataclasses import replace

import mujoco
import numpy as np

from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.comparison.paired_tests import there
from bumblebee.diagnosis.dataset.session import Session, make_session
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.estimation.integrator_error import explained_share
from bumblebee.diagnosis.residuals.problem import Problem, make_problem, window_weights
from bumblebee.diagnosis.simulation.simulate import residuals
from bumblebee.diagnosis.simulation.variation import vary
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from tests.diagnosis import arm


def _windows(rng: np.random.Generator, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Residuals of 30 windows before and after a change that is there by the share `size`."""
    change = rng.standard_normal((30, 300))
    change *= 0.1 / np.sqrt((change**2).mean())
    old = rng.standard_normal((30, 300)) + size * change
    return old, old - change


def test_a_hundredth_of_chi_square_is_seen_and_noise_is_not() -> None:
    """An effect of a tenth of the noise in amplitude is accepted every time; one that is not there hardly ever."""
    rng = np.random.default_rng(0)
    present = [there(*_windows(rng, 1.0), np.ones(30), 2.0) for _ in range(40)]
    absent = [there(*_windows(rng, 0.0), np.ones(30), 2.0) for _ in range(40)]
    assert all(present)
    assert not any(absent)


def _fits(effects: dict, kind: str, place: str, integrator: int | None = None) -> float:
    rollouts = arm.simulate(effects, count=2, seconds=3.0, seed=3)
    session = make_session(mujoco.MjSpec.from_string(arm.XML), rollouts, "arm", "memory")
    problem = _problem(session)
    if integrator is not None:
        problem = _as_if_measured(problem, integrator)
    weights = window_weights(problem.residual([[]])[0])
    before = gauss_newton(problem, (), (), weights)
    chosen = [c for c in all_candidates(session.plant, session.rollouts, []) if (c.effect, c.where) == (kind, place)]
    after = gauss_newton(problem, chosen, chosen[0].start, weights, coarse=True)
    return explained_share(problem, before, after, weights)


def _problem(session: Session) -> Problem:
    windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, [0, 1], 0.2, 24))
    rng = np.random.default_rng(0)
    return make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)


def _as_if_measured(problem: Problem, integrator: int) -> Problem:
    """The problem whose readings are this model's own by another integrator, without noise."""
    spec = problem.plant.spec.copy()
    spec.option.integrator = integrator
    rollout = problem.windows.source[0]
    other = make_session(spec, [rollout, replace(rollout, rollout_id="again")], "arm", "memory").plant
    windows = problem.windows

    left = residuals(other, problem.layout, windows, [vary(other, [])], problem.fine)[0]
    exact = replace(problem.whitener, offset=np.zeros_like(problem.whitener.offset))
    return replace(problem, windows=replace(windows, measured=windows.measured - left), whitener=exact)


def test_another_integrator_feigns_what_it_causes_and_no_friction() -> None:
    """All of an armature that only stands for Euler's steps, little of a friction that is there."""
    euler = int(mujoco.mjtIntegrator.mjINT_EULER)
    assert _fits({}, "armature", "j3", euler) > 0.4
    assert _fits({("coulomb_friction", "j2"): 0.3}, "coulomb_friction", "j2") < 0.2
