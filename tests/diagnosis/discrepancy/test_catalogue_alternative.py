"""The catalogue comes first: its effects are swapped in unless the discrepancy model is clearly better elsewhere."""

import numpy as np
import pytest

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.candidates.formula import formula
from bumblebee.diagnosis.comparison.holdout import Holdout
from bumblebee.diagnosis.comparison.information_criterion import criterion, numbers
from bumblebee.diagnosis.comparison.submodel import refitted
from bumblebee.diagnosis.discrepancy.catalogue_alternative import Offers, catalogue_swap
from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.thresholds.discrepancy import CatalogueAlternative
from tests.diagnosis.discrepancy.test_discover import prepared

COULOMB = Candidate("coulomb_friction", "pole", (0.0,), (0.02,))
VISCOUS = Candidate("viscous_friction", "pole", (0.02,), (0.02,))
SPRING = Candidate("joint_spring", "pole", (0.0, 0.0), (0.1, 0.02), (0, 1))
OFFERS = Offers([SPRING, VISCOUS, COULOMB])
TABLE = "curve(v, -2, 1, -0.05, 1, 0.05, -1, 2, -1)"


def taking(terms: dict[str, float], lines: list[str] | None = None, **truth: float | tuple[float, float]) -> Fit | None:
    """Fit that is swapped in for a discrepancy model on the pole, nothing having been found before it."""
    _, problem, judge = prepared(**truth)
    nothing = gauss_newton(problem, (), (), np.ones(len(problem.windows)))
    form = refitted(problem, (formula("pole", terms),), np.array(list(terms.values())))
    assert criterion(problem, form) > criterion(problem, nothing)
    return catalogue_swap(
        problem, Holdout(judge), nothing, form, "pole", OFFERS, ([] if lines is None else lines).append
    )


def test_a_catalogue_effect_is_swapped_in_for_a_table_that_follows_it() -> None:
    lines: list[str] = []
    named = taking({TABLE: 0.05}, lines, friction=(0.0, 0.05))
    assert "trying coulomb_friction on pole in place of a discrepancy model of pole" in lines
    assert "refitting with coulomb_friction on pole in place of a discrepancy model of pole" in lines
    assert named is not None
    assert [c.effect for c in named.chosen] == ["coulomb_friction"]
    assert named.values[0] == pytest.approx(0.05, rel=0.05)


@pytest.mark.parametrize(("terms", "truth"), [({"q^3": -0.6}, {"cubic": 0.6}), ({"v*abs(v)": -0.05}, {"drag": 0.05})])
def test_nothing_is_swapped_in_for_a_basis_function_that_the_catalogue_lacks(
    terms: dict[str, float], truth: dict[str, float]
) -> None:
    assert taking(terms, **truth) is None


def test_without_offers_nothing_is_swapped_in() -> None:
    _, problem, judge = prepared(friction=(0.0, 0.05))
    nothing = gauss_newton(problem, (), (), np.ones(len(problem.windows)))
    form = refitted(problem, (formula("pole", {TABLE: 0.05}),), np.array([0.05]))
    assert catalogue_swap(problem, Holdout(judge), nothing, form, "pole", Offers()) is None


def test_an_offer_acts_on_the_joint_on_what_it_carries_or_on_all_or_is_among_the_best() -> None:
    _, problem, _ = prepared()
    places = ("pole", "cart", "cart", "pole", "")
    kinds = ("armature", "armature", "viscous_friction", "link_mass", "command_delay")
    offers = Offers([Candidate(k, w, (0.0,), (0.1,)) for k, w in zip(kinds, places, strict=True)])
    on_pole = [(c.effect, c.where) for c in offers.on(problem.plant, "pole", CatalogueAlternative())]
    assert on_pole == [("armature", "pole"), ("armature", "cart"), ("link_mass", "pole"), ("command_delay", "")]
    assert len(offers.on(problem.plant, "cart", CatalogueAlternative())) == 5


@pytest.mark.parametrize(
    ("texts", "count"),
    [
        (("q^3",), 1),
        (("sin(5.2*q)", "cos(5.2*q)"), 3),
        (("friction(1)", "friction(rested(0.3, 0.02))"), 4),
        (("tau*curve(t, 0.2, -0.1, 0.8, 0.2, 1.3, 0.1)",), 3),
        (("friction(curve(q[other], -1, 0.1, 1, 0.2))", "v"), 3),
    ],
)
def test_the_heights_of_a_table_and_inner_numbers_are_parameters_too(texts: tuple[str, ...], count: int) -> None:
    assert numbers(formula("pole", dict.fromkeys(texts, 1.0))) == count
