"""Shafts are found where their swing passes for something else, and none is found in noise."""

import numpy as np
import pytest

from bumblebee.diagnosis.selection.changes import Vain
from bumblebee.diagnosis.selection.proposals.joint_elasticity import (
    best_elasticity,
    is_of_series,
    joint_elasticity_trials,
    series,
)
from bumblebee.diagnosis.selection.steps import go
from bumblebee.diagnosis.selection.swap import swap
from bumblebee.diagnosis.thresholds.proposals import JointElasticity
from tests.diagnosis import arm
from tests.diagnosis.selection.begun import answered
from tests.diagnosis.selection.test_swap import begun, names
from tests.diagnosis.strange_arm import simulate


def test_a_shaft_takes_the_place_of_the_rotor_that_it_passed_for() -> None:
    truth = {("series_elasticity", "j2"): (600.0,)}
    run = begun(arm.XML, simulate(truth, seed=3), {("armature", "j2"): 0.015})
    assert go(run, swap)
    assert names(run) == [("series_elasticity", "j2")]
    assert 1 / run.fit.values[0] == pytest.approx(600.0, rel=0.2)
    assert is_of_series(run.problem, run.fit.chosen[0], run.fit.values)
    assert not go(run, swap)


def test_stiffnesses_get_finer_where_a_servo_on_the_joint_would_shake() -> None:
    on_motor, on_joint = series(False, JointElasticity()), series(True, JointElasticity())
    assert (np.diff(on_motor) < 0).all() and (np.diff(on_joint) < 0).all()
    assert on_joint[-1] > on_motor[-1]
    soft = on_joint[on_joint < 40]
    assert (soft[:-1] / soft[1:]).max() < (on_motor[:-1] / on_motor[1:]).min()


@pytest.mark.slow
def test_a_joint_that_is_off_and_has_no_name_is_tried() -> None:
    run = begun(arm.XML, simulate({("series_elasticity", "j2"): (600.0,)}, seed=3), {})
    found, asked = answered(joint_elasticity_trials(run))
    assert [(t.candidate.where, t.values[1]) for t in found] == [("j2", 0.0)]
    assert asked == [Vain("series_elasticity", "j2")]
    run.hopeless.add(("series_elasticity", "j2"))
    assert answered(joint_elasticity_trials(run)) == ([], [])


def test_no_shaft_explains_noise() -> None:
    run = begun(arm.XML, simulate({}, seed=3), {})
    assert answered(joint_elasticity_trials(run))[0] == []
    assert best_elasticity(run.problem, run.fit, run.candidates, run.weights, "j2") is None


@pytest.mark.slow
def test_a_rotor_is_no_shaft() -> None:
    run = begun(arm.XML, arm.simulate({("armature", "j2"): 0.015}, seed=3), {("armature", "j2"): 0.013})
    assert not go(run, swap)
    assert names(run) == [("armature", "j2")]
