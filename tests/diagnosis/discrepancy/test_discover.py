"""Beyond the catalogue from end to end: what no effect names is found, refitted and kept; nothing else is."""

from functools import cache
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.candidates.candidate import Candidate
from bumblebee.diagnosis.candidates.formula import formula
from bumblebee.diagnosis.candidates.signal_scales import scales_of
from bumblebee.diagnosis.comparison.holdout import Holdout
from bumblebee.diagnosis.dataset.session import Session, make_session
from bumblebee.diagnosis.discrepancy.catalogue_terms import quantities_of, related, stiffer_than_the_drive
from bumblebee.diagnosis.discrepancy.discover import Discovery, discover
from bumblebee.diagnosis.discrepancy.form import short_texts
from bumblebee.diagnosis.discrepancy.residual_tests import JointActivity
from bumblebee.diagnosis.discrepancy.term_library import BasisFunction
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.report.discrepancy_entries import discovered_entry, structure_table, unexplained
from bumblebee.diagnosis.residuals.problem import Problem, make_problem, window_weights
from bumblebee.diagnosis.simulation.windows import choose_starts, cut
from bumblebee.diagnosis.thresholds.discrepancy import CatalogueTerms
from bumblebee.diagnosis.thresholds.report import MeasuredCurve, ReportThresholds
from tests.diagnosis import arm, cart


@cache
def prepared(**truth: float | tuple[float, float]) -> tuple[Session, Problem, Problem]:
    """Windows to fit and to judge by of four rollouts of the cart, made once for each truth."""
    rollouts = cart.record(count=4, seconds=8.0, **truth)
    session = make_session(mujoco.MjSpec.from_string(cart.xml()), rollouts, "cart", "memory")
    problems = []
    for ids in ([i for i in session.train if i not in session.accept], session.accept):
        windows = cut(session.plant, session.layout, session.rollouts, choose_starts(session.rollouts, ids, 0.2, 40))
        rng = np.random.default_rng(0)
        problems.append(make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng))
    return session, problems[0], problems[1]


def discovered(chosen: tuple[Candidate, ...] = (), lines: list[str] | None = None, **truth: float) -> Discovery:
    """Discovery beside the catalogue's effects `chosen`, fitted from their first trial."""
    session, problem, judge = prepared(**truth)
    ones = np.ones(len(problem.windows))
    start = np.concatenate([c.start for c in chosen]) if chosen else []
    fit = gauss_newton(problem, chosen, start, window_weights(gauss_newton(problem, (), (), ones).clean(problem)))
    activity = JointActivity(scales_of(session.plant, session.rollouts).torque)
    say = (lambda text: None) if lines is None else lines.append
    return discover(problem, Holdout(judge), fit, activity, say)


def test_a_cubic_spring_is_found_with_its_form_and_size() -> None:
    found = discovered(cubic=0.6)
    (form,) = found.fit.chosen
    assert (form.where, form.texts) == ("pole", ("q^3",))
    assert found.fit.of(form)[0] == pytest.approx(-0.6, rel=0.02)
    assert not unexplained(found, ReportThresholds())["significant"]


def test_every_refit_on_the_way_to_a_model_is_told() -> None:
    lines: list[str] = []
    discovered((), lines, cubic=0.6)
    begin, end = (lines.index(text) for text in ("looking for a discrepancy model of pole", lines[-1]))
    told = [line.removeprefix("discrepancy model of pole: ") for line in lines[begin + 1 : end]]
    assert told[0] == "refit with q^3" and told[-1] == "residual"
    assert lines[-1].startswith("discovered on pole: ")


def test_every_swap_for_one_basis_function_is_told() -> None:
    lines: list[str] = []
    discovered((Candidate("joint_spring", "pole", (0.0, 0.0), (0.02, 0.02), (0, 1)),), lines, cubic=0.6)
    assert lines[0] == "q^2, q^3 on pole instead of joint_spring" and "instead of catalogue effects" in lines[-1]


def test_a_curve_is_one_text_in_a_line_of_progress() -> None:
    texts = tuple(f"curve(v, -1.2345, {int(k == 0)}, 0.0123, {int(k == 1)}, 2.3456, {int(k == 2)})" for k in range(3))
    verdict = SimpleNamespace(size=np.array([0.54321, -0.25, 0.125]))
    one = SimpleNamespace(function=BasisFunction(texts, ("velocity",), 3), verdict=verdict)
    assert short_texts([one]) == "curve(v, -1.2345, 0.54321, 0.0123, ...)"


def test_a_complete_model_leaves_nothing() -> None:
    found = discovered()
    assert found.fit.chosen == () and not unexplained(found, ReportThresholds())["significant"]
    assert not any(row["significant"] for row in structure_table(found, MeasuredCurve()).values())


def test_a_name_that_half_explains_a_strange_effect_is_withdrawn() -> None:
    spring = Candidate("joint_spring", "pole", (0.0, 0.0), (0.02, 0.02), (0, 1))
    found = discovered((spring,), cubic=0.6)
    (form,) = found.fit.chosen
    assert form.texts[-1] == "q^3"
    assert found.fit.of(form)[-1] == pytest.approx(-0.6, rel=0.03)
    assert found.withdrawn == ["joint_spring on pole"]


def test_a_true_name_is_neither_withdrawn_nor_joined_by_another() -> None:
    found = discovered((Candidate("coulomb_friction", "pole", (0.0,), (0.02,)),), friction=(0.0, 0.05))
    assert [c.effect for c in found.fit.chosen] == ["coulomb_friction"]
    assert found.fit.values[0] == pytest.approx(0.05, rel=0.05)


def test_an_entry_has_a_coefficient_and_an_interval_for_each_term() -> None:
    form = formula("pole", {"sin(3*q)": 0.5, "cos(3*q)": -0.1})
    entry = discovered_entry(form, np.array([0.5, -0.1]), np.array([0.1, 0.2]), 0.9, 8.0, "formula")
    terms = entry["parameters"]["terms"]
    assert [t["term"] for t in terms] == ["sin(3*q)", "cos(3*q)"]
    assert terms[0]["ci95"] == pytest.approx([0.4, 0.6]) and entry["where"] == ["pole"]


@pytest.mark.parametrize(
    ("texts", "effect", "same"),
    [
        (["friction(sin(3*q))"], "coulomb_friction", True),
        (["friction(sin(3*q))"], "cogging", False),
        (["sin(15*q)"], "cogging", True),
        (["v*abs(v)"], "viscous_friction", True),
        (["q[other]"], "joint_spring", False),
        (["tau*sin(1.5*t)"], "joint_spring", False),
        (["bound(u - q, 0.1)"], "joint_spring", False),
    ],
)
def test_a_constant_part_belongs_to_a_law_of_its_family(texts: list[str], effect: str, same: bool) -> None:
    assert related(texts, effect) is same


@pytest.mark.parametrize(
    ("texts", "on"),
    [
        (["sin(15*q)", "cos(15*q)"], ("position",)),
        (["tau*sin(1.5*t)"], ("torque", "time")),
        (["bound(u - q, 0.1)"], ("target", "position")),
        (["slewed(2.5, 0.02) - u"], ("target", "history")),
        (["friction(rested(0.3, 0.02))"], ("history",)),
        (["v['left-hip']*abs(v['left-hip'])", "v*abs(v)"], ("another joint (left-hip)", "velocity")),
    ],
)
def test_a_form_says_what_it_depends_on(texts: list[str], on: tuple[str, ...]) -> None:
    assert quantities_of(texts) == on


def test_a_target_changed_on_its_way_cannot_push_harder_than_the_servo() -> None:
    """The servo has a kp of 60 on j2; terms without the target have no such bound."""
    rollouts = arm.simulate({}, count=1, seconds=1.0)
    plant = arm.session_of(rollouts).plant
    late = formula("j2", {"slewed(0.5, 0.02) - u": 60.0})
    assert not stiffer_than_the_drive(plant, late, np.array([60.0]), CatalogueTerms())
    assert stiffer_than_the_drive(plant, late, np.array([-600.0]), CatalogueTerms())
    assert not stiffer_than_the_drive(plant, formula("j2", {"q^3": 600.0}), np.array([600.0]), CatalogueTerms())
