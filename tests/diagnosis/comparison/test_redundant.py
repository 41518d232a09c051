"""Effects that take nothing off the judging windows' error are not reported; those that do, and limits, are."""

import numpy as np
import pytest

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.comparison.backward_elimination import (
    _growth,
    drop_redundant,
    drop_unpaid_saturations,
)
from bumblebee.diagnosis.comparison.holdout import Holdout
from bumblebee.diagnosis.estimation.fit import typical_power
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from tests.diagnosis.discrepancy.test_discover import prepared

COULOMB = Candidate("coulomb_friction", "pole", (0.0,), (0.02,))
SPRING = Candidate("joint_spring", "pole", (0.0, 0.0), (0.1, 0.02), (0, 1))
LIMIT = Candidate("torque_limit", "pole", (50.0,), (-1.0,))


def test_an_effect_that_only_spoils_the_judging_windows_is_dropped_and_the_rest_refitted() -> None:
    _, problem, judge = prepared(friction=(0.0, 0.05))
    fit = gauss_newton(problem, (COULOMB, SPRING), np.array([0.05, 0.003, 0.0]), np.ones(len(problem.windows)), 0)
    kept = drop_redundant(problem, Holdout(judge), fit)
    assert kept.chosen == (COULOMB,)
    assert kept.values[0] == pytest.approx(0.05, rel=0.05)
    assert drop_redundant(problem, Holdout(), fit) is fit


def test_of_an_effect_that_they_hardly_feel_the_judging_windows_say_nothing() -> None:
    """With a small share of that spring they change by less than what could be detected: it is chance how they err."""
    _, problem, judge = prepared(friction=(0.0, 0.05))
    ones = np.ones(len(problem.windows))
    for share, stays in ((1.0, False), (0.03, True)):
        fit = gauss_newton(problem, (COULOMB, SPRING), np.array([0.05, share * 0.003, 0.0]), ones, 0)
        growth, felt = _growth(judge, fit)
        assert growth[1] <= 0
        assert (felt[1] < problem.thresholds.comparison.elimination.felt) == stays
        assert (drop_redundant(problem, Holdout(judge), fit) is fit) == stays


def test_a_limit_that_no_judging_window_feels_stays() -> None:
    _, problem, judge = prepared(friction=(0.0, 0.05))
    fit = gauss_newton(problem, (COULOMB, LIMIT), np.array([0.05, 40.0]), np.ones(len(problem.windows)), 0)
    assert drop_redundant(problem, Holdout(judge), fit) is fit


def test_a_limit_that_nothing_reaches_is_spent_beside_another_effect() -> None:
    _, problem, judge = prepared(friction=(0.0, 0.05))
    ones = np.ones(len(problem.windows))
    fit = gauss_newton(problem, (COULOMB, LIMIT), np.array([0.05, 40.0]), ones, 0)
    kept = drop_unpaid_saturations(problem, Holdout(judge), fit)
    assert kept.chosen == (COULOMB,)
    assert kept.values[0] == pytest.approx(0.05, rel=0.05)
    alone = gauss_newton(problem, (LIMIT,), np.array([40.0]), ones, 0)
    assert drop_unpaid_saturations(problem, Holdout(judge), alone) is alone


def test_far_from_the_model_nothing_is_dropped() -> None:
    """Friction of ten times the other tests' is not in the fit: what the mean square says there decides nothing."""
    _, problem, judge = prepared(friction=(0.0, 0.5))
    fit = gauss_newton(problem, (SPRING,), np.array([0.3, 0.0]), np.ones(len(problem.windows)), 0)
    assert typical_power(Holdout(judge).left([fit])[0]) > 4
    assert drop_redundant(problem, Holdout(judge), fit) is fit


def test_what_the_error_after_a_second_needs_stays(monkeypatch) -> None:
    _, problem, judge = prepared(friction=(0.0, 0.05))
    monkeypatch.setattr(Holdout, "worse_later", lambda self, before, after: True)
    fit = gauss_newton(problem, (COULOMB, SPRING), np.array([0.05, 0.003, 0.0]), np.ones(len(problem.windows)), 0)
    assert drop_redundant(problem, Holdout(judge), fit) is fit
