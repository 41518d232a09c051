"""Shafts are found where their swing passes for something else, and none is found in noise."""

import pytest

from bumblebee.diagnosis.exchange import exchange
from bumblebee.diagnosis.shafts import best_shaft, shaft_trials
from tests.diagnosis import arm
from tests.diagnosis.strange_arm import simulate
from tests.diagnosis.test_exchange import begun, names


def test_a_shaft_takes_the_place_of_the_rotor_that_it_passed_for() -> None:
    truth = {("series_elasticity", "j2"): (600.0,)}
    run = begun(arm.XML, simulate(truth, seed=3), {("armature", "j2"): 0.015})
    assert exchange(run)
    assert names(run) == [("series_elasticity", "j2")]
    assert 1 / run.fit.values[0] == pytest.approx(600.0, rel=0.2)


def test_a_joint_that_is_off_and_has_no_name_is_tried() -> None:
    run = begun(arm.XML, simulate({("series_elasticity", "j2"): (600.0,)}, seed=3), {})
    found = shaft_trials(run.problem, run.fit, run.candidates, run.weights, run.hopeless)
    assert [(t.candidate.where, t.values[1]) for t in found] == [("j2", 0.0)]
    assert run.hopeless == {("series_elasticity", "j2")}
    assert not shaft_trials(run.problem, run.fit, run.candidates, run.weights, run.hopeless)


def test_no_shaft_explains_noise() -> None:
    run = begun(arm.XML, simulate({}, seed=3), {})
    assert not shaft_trials(run.problem, run.fit, run.candidates, run.weights, set())
    assert all(best_shaft(run.problem, run.fit, run.candidates, run.weights, j) is None for j in arm.JOINTS)


def test_a_rotor_is_no_shaft() -> None:
    run = begun(arm.XML, arm.simulate({("armature", "j2"): 0.015}, seed=3), {("armature", "j2"): 0.013})
    assert not exchange(run)
    assert names(run) == [("armature", "j2")]
