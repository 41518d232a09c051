"""A joint that stands still is held by dry friction, not by a damping that would keep it back wherever it moves."""

import re

import pytest

from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.residuals.problem import Problem, window_weights
from bumblebee.diagnosis.selection.proposals.all_joints.held_joints import held_by_dry_friction
from tests.diagnosis import arm

DRY, VISCOUS, KD = ("coulomb_friction", "j1"), ("viscous_friction", "j1"), ("kd", "j1")
WEAK = arm.XML.replace('joint="j1" kp="40" kv="3"', 'joint="j1" kp="0.5" kv="0.1"')


def _fitted(
    truth: dict[tuple[str, str], float], values: dict[tuple[str, str], float], xml: str = arm.XML
) -> tuple[Problem, Fit]:
    """A fit of the first joint's friction and damping at these values."""
    session = arm.session_of(arm.simulate(truth, count=2, seconds=4.0, xml=xml), xml)
    problem = arm.problem_of(session, [0, 1], 24)
    every = all_candidates(session.plant, session.rollouts, [])
    chosen = [next(c for c in every if (c.effect, c.where) == place) for place in values]
    weights = window_weights(problem.residual([[]])[0])
    return problem, gauss_newton(problem, chosen, [*values.values()], weights, iterations=0)


@pytest.mark.parametrize("damping", [{VISCOUS: 500.0}, {KD: 5000.0}, {VISCOUS: 250.0, KD: 2500.0}])
def test_a_joint_that_its_friction_holds_keeps_the_dry_one(damping: dict[tuple[str, str], float]) -> None:
    """A weak servo's first joint stands under friction of 3 N m; 500 N m s/rad of damping do as well."""
    problem, fit = _fitted({DRY: 3.0}, {DRY: 0.0, **damping}, WEAK)
    chosen, values = held_by_dry_friction(problem, fit)
    assert [(c.effect, c.where) for c in chosen] == [DRY]
    assert values[0] / 40 in problem.thresholds.selection.proposals.all_joints.holding  # of a limit of 40 N m


def test_a_joint_that_moves_keeps_what_the_data_show() -> None:
    problem, fit = _fitted({VISCOUS: 20.0}, {DRY: 0.0, VISCOUS: 20.0})
    chosen, values = held_by_dry_friction(problem, fit)
    assert chosen == list(fit.chosen) and values == pytest.approx(fit.values)


def test_less_than_the_servos_own_damping_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, fit = _fitted({VISCOUS: 1.0}, {DRY: 0.0, VISCOUS: 1.0})
    monkeypatch.setattr(Problem, "residual", lambda *_, **__: pytest.fail("simulated"))
    assert held_by_dry_friction(problem, fit)[0] == list(fit.chosen)


def test_a_drive_without_a_limit_is_not_asked() -> None:
    endless = re.sub(r' forcerange="[^"]*"', "", WEAK)
    problem, fit = _fitted({DRY: 3.0}, {DRY: 0.0, VISCOUS: 500.0}, endless)
    assert held_by_dry_friction(problem, fit)[0] == list(fit.chosen)
