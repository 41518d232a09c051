"""A drive whose torque limit is far below its load, beside another large effect: both by their names, nothing else."""

import numpy as np
import pytest

from bumblebee.diagnosis.candidates import all_candidates
from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.diagnose import diagnose
from bumblebee.diagnosis.estimation import gauss_newton
from bumblebee.diagnosis.selection.proposals.drive_grid import drive_trials
from tests.diagnosis import arm

LIMIT, OFFSET = 1.2, -0.25


@pytest.fixture(scope="module")
def session() -> Session:
    """Session of an arm whose shoulder holds at most 1.2 N m, its load asks for more, and whose elbow reads wrongly."""
    robot = {("torque_limit", "j2"): LIMIT, ("encoder_offset", "j3"): OFFSET}
    return arm.session_of(arm.simulate(robot, count=4, seconds=3.0, seed=4))


def test_a_limit_is_tried_at_its_size_and_explains_more_than_a_weak_motor(session: Session) -> None:
    problem = arm.problem_of(session, range(4), 20)
    candidates = [c for c in all_candidates(session.plant, session.rollouts, []) if c.where == "j2"]
    weights = np.ones(len(problem.windows))
    fit = gauss_newton(problem, (), (), weights)
    trials = {t.candidate.effect: t for t in drive_trials(problem, fit, candidates, weights, 0.0)}
    assert trials["torque_limit"].cost == min(t.cost for t in trials.values())
    assert drive_trials(problem, fit, candidates, weights, 1e12) == []


@pytest.mark.slow
def test_both_are_found_by_name(session: Session) -> None:
    found = diagnose(session, arm.SMALL).effects
    sizes = {(e.effect, *e.where): next(iter(e.parameters.values())) for e in found}
    assert set(sizes) == {("torque_limit", "j2"), ("encoder_offset", "j3")}
    assert sizes["torque_limit", "j2"] == pytest.approx(LIMIT, rel=0.05)
    assert sizes["encoder_offset", "j3"] == pytest.approx(OFFSET, rel=0.02)
