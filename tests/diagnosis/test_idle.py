"""What takes nothing off the judging windows' error is not reported; what does, and limits, are."""

import numpy as np
import pytest

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.fit import gauss_newton
from bumblebee.diagnosis.holdout import Holdout
from bumblebee.diagnosis.idle import without_idle
from tests.diagnosis.test_discover import prepared

COULOMB = Candidate("coulomb_friction", "pole", (0.0,), (0.02,))
SPRING = Candidate("joint_spring", "pole", (0.0, 0.0), (0.1, 0.02), (0, 1))
LIMIT = Candidate("torque_limit", "pole", (50.0,), (-1.0,))


def test_an_effect_that_only_spoils_the_judging_windows_is_dropped_and_the_rest_refitted() -> None:
    _, problem, judge = prepared(friction=(0.0, 0.05))
    fit = gauss_newton(problem, (COULOMB, SPRING), np.array([0.05, 0.3, 0.0]), np.ones(len(problem.windows)), 0)
    kept = without_idle(problem, Holdout(judge), fit)
    assert kept.chosen == (COULOMB,)
    assert kept.values[0] == pytest.approx(0.05, rel=0.05)
    assert without_idle(problem, Holdout(), fit) is fit


def test_a_limit_that_no_judging_window_feels_stays() -> None:
    _, problem, judge = prepared(friction=(0.0, 0.05))
    fit = gauss_newton(problem, (COULOMB, LIMIT), np.array([0.05, 40.0]), np.ones(len(problem.windows)), 0)
    assert without_idle(problem, Holdout(judge), fit) is fit
