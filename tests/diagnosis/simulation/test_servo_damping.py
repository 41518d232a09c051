"""How fast servos damp a joint, and what it does to the steps of sensitivities."""

import re

import numpy as np
import pytest

from bumblebee.diagnosis.simulation.servo_damping import _fastest, damping_rates
from bumblebee.diagnosis.simulation.variation import vary
from bumblebee.sim.effects import single
from tests.diagnosis import arm


def test_it_is_the_damping_over_the_inertia() -> None:
    assert _fastest(np.diag([0.0, 50.0]), np.diag([1.0, 2.0])) == pytest.approx(25.0)


def test_a_joint_without_inertia_is_damped_at_once() -> None:
    assert _fastest(np.diag([1.0, 50.0]), np.diag([1.0, 0.0])) == np.inf


def test_an_armature_slows_it_down_and_a_gap_is_asked_as_if_closed() -> None:
    session = arm.session_of(arm.simulate({}, count=1, seconds=2.0))
    plant, qpos = session.plant, np.zeros((1, session.plant.model.nq))
    plain, slow, gap = (
        damping_rates(plant, vary(plant, effects), qpos)[0]
        for effects in ([], [single("armature", "j3", 5.0)], [single("backlash", "j3", 0.02)])
    )
    assert slow < plain == gap


def test_sensitivities_are_simulated_in_fine_steps_where_a_joint_comes_to_rest_within_a_coarse_one() -> None:
    """As long as the model lacks what slows the joint down: a rotor, in a model made from a drawing."""
    drawn = re.sub(r'kv="(\d)"', r'kv="1\1"', re.sub(r'armature="[.0-9]+"', 'armature="0"', arm.XML))
    session = arm.session_of(arm.simulate({}, count=1, seconds=4.0, xml=drawn), drawn)
    rotors = [single("armature", joint, 0.5) for joint in arm.JOINTS]
    stiff, slow = arm.problem_of(session, [0], 6), arm.problem_of(session, [0], 6, rotors)
    assert stiff.coarse == stiff.fine < stiff.coarsest
    assert slow.coarse == slow.coarsest == stiff.coarsest
