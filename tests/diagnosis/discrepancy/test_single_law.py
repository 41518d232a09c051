"""One basis function in a swap for several effects: it goes before them where it explains more with no more numbers."""

import sys

import numpy as np
import pytest

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.candidates.formula import formula
from bumblebee.diagnosis.comparison.compare import compare
from bumblebee.diagnosis.comparison.holdout import Holdout
from bumblebee.diagnosis.comparison.submodel import refitted
from bumblebee.diagnosis.discrepancy.single_law import groups
from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.residuals.problem import Problem
from bumblebee.diagnosis.thresholds.comparison import WindowByWindow
from tests.diagnosis.discrepancy.test_discover import discovered, prepared

RULE = WindowByWindow()
COULOMB = Candidate("coulomb_friction", "pole", (0.0,), (0.02,))
SPRING = Candidate("joint_spring", "pole", (0.0, 0.0), (0.1, 0.02), (0, 1))
COGGING = Candidate("cogging", "pole", (0.0, 0.0, 2.0), (0.02, 0.02, 0.0), (0, 1))
CUBIC = formula("pole", {"q^3": 1.0})


def at_rest(problem: Problem, *chosen: Candidate) -> Fit:
    """The effects where they change nothing."""
    values = np.concatenate([c.nominal for c in chosen])
    return gauss_newton(problem, chosen, values, np.ones(len(problem.windows)), iterations=0)


@pytest.mark.slow
def test_a_cubic_spring_that_stands_as_a_spring_and_cogging_gets_its_basis_function() -> None:
    found = discovered((SPRING, COGGING), cubic=0.6)
    (form,) = found.fit.chosen
    assert form.texts == ("q^3",)
    assert found.fit.of(form)[0] == pytest.approx(-0.6, rel=0.03)
    assert found.withdrawn == ["joint_spring on pole", "cogging on pole"]
    assert found.kinds == {"pole": "formula"}


def test_effects_on_a_joint_come_in_every_combination_all_of_them_first() -> None:
    _, problem, _ = prepared()
    other = Candidate("coulomb_friction", "cart", (0.0,), (0.1,))
    fit = at_rest(problem, COULOMB, other, SPRING, CUBIC)
    assert list(groups(fit, "pole", most=3)) == [(COULOMB, SPRING), (COULOMB,), (SPRING,)]
    assert list(groups(fit, "cart", most=3)) == [(other,)]


def test_a_basis_function_is_better_than_an_effect_only_where_it_is_true() -> None:
    for truth, law, better in (({"cubic": 0.6}, -0.6, True), ({"friction": (0.0, 0.05)}, -0.01, False)):
        _, problem, judge = prepared(**truth)
        named = refitted(problem, (COULOMB,), np.array([0.02]))
        form = refitted(problem, (CUBIC,), np.array([law]))
        assert compare(problem, Holdout(judge), named, form).passes(RULE) is better


def test_a_basis_function_with_more_numbers_than_the_effects_is_never_better() -> None:
    _, problem, judge = prepared(cubic=0.6)
    named = refitted(problem, (COULOMB,), np.array([0.02]))
    form = refitted(problem, (formula("pole", {"q": 1.0, "q^3": 1.0}),), np.array([0.0, -0.6]))
    assert not compare(problem, Holdout(judge), named, form).passes(RULE)


def test_a_basis_function_that_saves_two_numbers_and_fits_better_need_not_do_so_beyond_doubt(monkeypatch) -> None:
    _, problem, judge = prepared(cubic=0.6)
    monkeypatch.setattr(sys.modules["bumblebee.diagnosis.comparison.compare"], "margin", lambda gain, z=2.0: np.inf)
    form = refitted(problem, (CUBIC,), np.array([-0.6]))
    for names, start, better in (((SPRING, COULOMB), [0.1, 0.0, 0.01], True), ((COULOMB,), [0.01], False)):
        named = refitted(problem, names, np.array(start))
        assert compare(problem, Holdout(judge), named, form).passes(RULE) is better
