"""A name gives way to one that fits better; friction that grows at rest is tried beside dry friction."""

import numpy as np
import pytest

from bumblebee.diagnosis.comparison.compare import compare
from bumblebee.diagnosis.comparison.submodel import linearly_without
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.prepare import gather
from bumblebee.diagnosis.residuals.problem import window_weights
from bumblebee.diagnosis.selection import confounding
from bumblebee.diagnosis.selection.proposals.stribeck import add_dry_friction, add_stribeck_friction
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.steps import go
from bumblebee.diagnosis.selection.swap import swap
from bumblebee.diagnosis.selection.trial import Trial
from bumblebee.diagnosis.thresholds.comparison import NoWorseWithinErrors
from bumblebee.measured.rollout import Rollout
from tests.diagnosis import arm, cart
from tests.diagnosis.strange_arm import simulate
from tests.diagnosis.test_catalogue import CONFIG


def begun(xml: str, rollouts: list[Rollout], chosen: dict[tuple[str, str], float | tuple[float, ...]]) -> SearchState:
    """A search that has found some effects, fitted from some values; that its servos may be far off is not asked."""
    session = arm.session_of(rollouts, xml)
    material = gather(session, CONFIG, np.random.default_rng(0), lambda text: None)
    run = SearchState(material.problem, material.holdout, material.remade, CONFIG.search, lambda text: None)
    run.open()
    names = [next(c for c in run.candidates if (c.effect, c.where) == key) for key in chosen]
    values = np.concatenate([np.empty(0), *(np.atleast_1d(v) for v in chosen.values())])
    fit = gauss_newton(run.problem, names, values, run.weights)
    run.weights = window_weights(fit.clean(run.problem))
    run.fit = gauss_newton(run.problem, names, fit.values, run.weights)
    return run


def names(run: SearchState) -> list[tuple[str, str]]:
    """Names and places that it has found."""
    return [(c.effect, c.where) for c in run.fit.chosen]


def test_a_wrong_name_gives_way_to_the_right_one_and_that_stays() -> None:
    run = begun(cart.xml(), cart.record(friction=(0.0, 0.05)), {("viscous_friction", "pole"): 0.03})
    assert go(run, swap)
    assert names(run) == [("coulomb_friction", "pole")]
    assert run.fit.values[0] == pytest.approx(0.05, rel=0.05)
    assert [s.candidate for s in run.steps] == list(run.fit.chosen)
    assert not go(run, swap)


def test_two_names_that_stand_for_one_give_way_to_it() -> None:
    two = {("viscous_friction", "pole"): 0.03, ("armature", "pole"): 0.001}
    run = begun(cart.xml(), cart.record(friction=(0.0, 0.05)), two)
    assert go(run, swap)
    assert names(run) == [("coulomb_friction", "pole")]


@pytest.mark.parametrize("stiction", [0.0, 1.5])
def test_friction_that_grows_at_rest_is_found_beside_dry_friction_only_where_it_is(stiction: float) -> None:
    truth = {("coulomb_friction", "j2"): (1.0,)} | ({("stribeck_friction", "j2"): (stiction, 0.15)} if stiction else {})
    run = begun(arm.XML, simulate(truth, seed=3), {("coulomb_friction", "j2"): 1.0})
    assert go(run, add_stribeck_friction) is bool(stiction)
    assert [n for n, _ in names(run)] == ["coulomb_friction", *(["stribeck_friction"] if stiction else [])]
    if stiction:
        assert run.fit.of(run.fit.chosen[1])[0] == pytest.approx(stiction, rel=0.15)


@pytest.mark.parametrize("level", [0.0, 1.0])
def test_friction_that_grows_at_rest_is_told_from_the_dry_friction_that_it_sits_on(level: float) -> None:
    truth = {("stribeck_friction", "j2"): (1.5, 0.15)} | ({("coulomb_friction", "j2"): (level,)} if level else {})
    run = begun(arm.XML, simulate(truth, seed=3), {("stribeck_friction", "j2"): (1.0, 0.3)})
    go(run, add_dry_friction)
    assert [n for n, _ in names(run)] == ["stribeck_friction", *(["coulomb_friction"] if level else [])]
    assert run.fit.of(run.fit.chosen[0])[0] == pytest.approx(1.5, rel=0.15)
    if level:
        assert run.fit.of(run.fit.chosen[1])[0] == pytest.approx(level, rel=0.1)


def test_cogging_is_fitted_in_its_periods_before_a_spring_is_said_to_have_no_rival() -> None:
    run = begun(arm.XML, simulate({("cogging", "j2"): (1.5, 0.0, 4.0)}, seed=3), {("joint_spring", "j2"): (1.0, 0.0)})
    rest = linearly_without(run.fit, run.fit.chosen[0])
    there = [c for c in run.candidates if (c.effect, c.where) == ("cogging", "j2")]
    rival = min((c for c in there if c.start[2] > 4.5), key=lambda c: c.start[2])
    first = Trial(rival, rival.start, np.inf, np.zeros(0))
    placed = confounding._in_place(run, rest, first)
    assert placed.values[2] == pytest.approx(4.0, rel=0.05)
    assert placed.cost < run.fit.cost
    assert compare(run.problem, run.holdout, run.fit, placed).passes(NoWorseWithinErrors())
