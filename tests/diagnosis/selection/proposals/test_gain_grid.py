"""Servos whose gains are off by factors are found from far away; servos that are right are left alone."""

import re

import numpy as np
import pytest

from bumblebee.diagnosis.candidates.enumerate import all_candidates
from bumblebee.diagnosis.dataset.session import Session
from bumblebee.diagnosis.residuals.problem import Problem, make_problem
from bumblebee.diagnosis.selection.proposals.gain_grid import gains_by_grid
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from tests.diagnosis import arm


def _opened(xml: str) -> tuple[Session, Problem]:
    rollouts = arm.simulate({}, count=2, seconds=6.0)
    session = arm.session_of(rollouts, xml)
    windows = cut(session.plant, session.layout, rollouts, choose_starts(rollouts, [0, 1], 0.2, 10))
    rng = np.random.default_rng(0)
    problem = make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)
    return session, problem


def test_gains_declared_thirty_and_ten_times_too_large_are_found() -> None:
    xml = re.sub(r'kp="(\d+)"', lambda m: f'kp="{30 * int(m[1])}"', arm.XML)
    xml = re.sub(r'kv="(\d+)"', lambda m: f'kv="{10 * int(m[1])}"', xml)
    session, problem = _opened(xml)
    found = gains_by_grid(problem, all_candidates(session.plant, session.rollouts, []))
    factors = {(c.effect, c.where): value for c, value in found}
    for joint in arm.JOINTS:
        assert factors["kp", joint] == pytest.approx(1 / 30, rel=0.35)
        assert factors["kd", joint] == pytest.approx(1 / 10, rel=0.5)
        assert factors.get(("coulomb_friction", joint), 0.0) < 0.3
    assert all(abs(c.step[0]) == pytest.approx(0.1 * value) for c, value in found)


def test_servos_that_are_right_stay() -> None:
    session, problem = _opened(arm.XML)
    assert gains_by_grid(problem, all_candidates(session.plant, session.rollouts, [])) == []
