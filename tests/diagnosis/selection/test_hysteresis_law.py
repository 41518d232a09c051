"""A hysteresis by the other law: refuted where the joint goes round the loop, as good where only its slope shows."""

from functools import cache

import numpy as np
import pytest

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.comparison import Holdout
from bumblebee.diagnosis.estimation import gauss_newton
from bumblebee.diagnosis.report import law_notes
from bumblebee.diagnosis.residuals import window_weights
from bumblebee.diagnosis.selection.final_fit import Refined, half_widths, with_other_laws
from tests.diagnosis import arm
from tests.diagnosis.strange_arm import simulate

SLOPE = 6.0  # N m/rad


@cache
def fitted(width: float) -> tuple[Refined, Candidate]:
    """The arm with a spring on j2 that yields at `width` [rad], fitted by that law; and the candidate of Dahl's."""
    truth = SLOPE * width, width
    session = arm.session_of(simulate({("hysteresis", "j2"): truth}, count=3, seed=5))
    problem = arm.problem_of(session, [0, 1, 2], 22)
    chosen, other = (
        Candidate("hysteresis", "j2", (0.0, 0.0, 0.0), (*truth, dahl), shape_scale=0.3 * width) for dahl in (0.0, 1.0)
    )
    start = np.array([*truth, 0.0])
    first = gauss_newton(problem, [chosen], start, np.ones(len(problem.windows)), 1)
    weights = window_weights(first.clean(problem))
    fit = gauss_newton(problem, [chosen], first.values, weights)
    return Refined(problem, fit, weights, half_widths(problem, fit, weights)), other


def test_a_law_that_the_windows_refute_leaves_the_interval_as_it_is() -> None:
    last, other = fitted(0.1)
    assert not with_other_laws(last, Holdout(), [*last.fit.chosen, other]).other_laws


def test_where_only_the_slope_shows_both_laws_stand_with_their_intervals_and_a_note() -> None:
    last, other = fitted(5.0)
    found = with_other_laws(last, Holdout(), [*last.fit.chosen, other])
    law = found.other_laws[last.fit.chosen[0]]
    assert law.values[2] == 1.0
    assert law.values[0] / law.values[1] == pytest.approx(SLOPE, rel=0.15)
    (note,) = law_notes(found)
    assert "hysteresis on j2" in note
    assert "slope" in note


def test_a_joint_that_can_have_one_law_alone_is_asked_no_other() -> None:
    last, _ = fitted(5.0)
    assert not with_other_laws(last, Holdout(), last.fit.chosen).other_laws
