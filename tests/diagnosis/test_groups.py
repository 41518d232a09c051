"""Several effects at once: what the slopes promise beside each other, and what stays of it in the simulator."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.acceptance import wald
from bumblebee.diagnosis.candidates import Candidate, all_candidates
from bumblebee.diagnosis.fit import Fit, gauss_newton
from bumblebee.diagnosis.groups import beside_each_other, fitted_with
from bumblebee.diagnosis.many import without_some
from bumblebee.diagnosis.problem import Problem, make_problem, window_weights
from bumblebee.diagnosis.scales import scales_of
from bumblebee.diagnosis.scores import Columns, Scores
from bumblebee.diagnosis.screen import pulse_sizes, screen
from bumblebee.diagnosis.session import make_session
from bumblebee.diagnosis.windows import choose_starts, cut
from tests.diagnosis import arm

TRUTH = {("viscous_friction", "j1"): 0.3, ("coulomb_friction", "j2"): 0.5, ("motor_strength", "j3"): 0.9}


def _screened(effects: dict[tuple[str, str], float]) -> tuple[Problem, Columns, Fit, np.ndarray]:
    rollouts = arm.simulate(effects, count=2, seconds=5.0)
    session = make_session(mujoco.MjSpec.from_string(arm.XML), rollouts, "arm", "memory")
    windows = cut(session.plant, session.layout, rollouts, choose_starts(rollouts, [0, 1], 0.2, 40))
    rng = np.random.default_rng(0)
    problem = make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)
    torque = scales_of(session.plant, rollouts).torque
    candidates = all_candidates(session.plant, rollouts, [])
    columns, _ = screen(problem, candidates, [], pulse_sizes(problem, torque))
    weights = window_weights(problem.residual([[]])[0])
    return problem, columns, gauss_newton(problem, (), (), weights), weights


def _sure(c: Candidate, tests: Scores, k: int) -> bool:
    return bool(tests.z[k] >= 5.0)


def test_three_effects_are_promised_beside_each_other_and_found_together() -> None:
    problem, columns, fit, weights = _screened(TRUTH)
    new = beside_each_other(problem, columns, fit, weights, _sure)
    assert set(TRUTH) <= {(c.effect, c.where) for c, _ in new}
    together, weights = fitted_with(problem, fit, new, 5.0)
    found = {(c.effect, c.where): float(together.of(c)[0]) for c in together.chosen}
    for place, value in TRUTH.items():
        nominal = 1.0 if place[0] == "motor_strength" else 0.0
        assert found[place] - nominal == pytest.approx(value - nominal, rel=0.1), place
    assert min(wald(problem, together, weights, k) for k in range(len(together.chosen))) >= 5.0


def test_a_complete_model_is_promised_nothing_and_keeps_nothing_that_it_is_given() -> None:
    problem, columns, fit, weights = _screened({})
    assert beside_each_other(problem, columns, fit, weights, _sure) == []
    given = [(c, np.array(c.nominal)) for c in columns.candidates if c.effect == "viscous_friction"]
    assert len(given) == 3 and fitted_with(problem, fit, given, 5.0)[0].chosen == ()


def test_an_effect_taken_out_by_slopes_leaves_what_a_refit_in_the_simulator_leaves() -> None:
    problem, columns, fit, weights = _screened({("viscous_friction", "j1"): 0.1, ("viscous_friction", "j2"): 0.1})
    three = [c for c in columns.candidates if c.effect == "viscous_friction"]
    full = gauss_newton(problem, three, [c.nominal[0] for c in three], weights, iterations=3)
    less = without_some(problem, full, weights, {2})
    again = gauss_newton(problem, less.chosen, less.values, weights, iterations=3)
    assert less.chosen == tuple(three[:2])
    assert less.values == pytest.approx(again.values, abs=0.002)
    assert less.cost == pytest.approx(again.cost, rel=0.01)
    assert without_some(problem, full, weights, {0, 1, 2}).cost == pytest.approx(fit.cost, rel=0.05)
