"""How fast servos damp a joint, and what it does to the steps of sensitivities."""

import re
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.estimation.integrator_error import _with_integrator
from bumblebee.diagnosis.simulation.servo_damping import _fastest, _rates, damping_rates
from bumblebee.diagnosis.simulation.variation import vary
from bumblebee.sim.effects import single
from tests.diagnosis import arm


def test_it_is_the_damping_over_the_inertia() -> None:
    assert _fastest(np.diag([0.0, 50.0]), np.diag([1.0, 2.0])) == pytest.approx(25.0)


def test_a_joint_without_inertia_is_damped_at_once() -> None:
    assert _fastest(np.diag([1.0, 50.0]), np.diag([1.0, 0.0])) == np.inf


def test_an_armature_slows_it_down_and_a_gap_is_asked_as_if_closed() -> None:
    session = arm.session_of(arm.simulate({}, count=1, seconds=2.0))
    problem = arm.problem_of(session, [0], 4)
    plain, slow, gap = (
        damping_rates(session.plant, vary(session.plant, effects), problem.windows)
        for effects in ([], [single("armature", "j3", 5.0)], [single("backlash", "j3", 0.02)])
    )
    assert (slow < plain).all()
    assert gap == pytest.approx(plain)


def test_a_joints_own_damping_and_a_second_drive_count() -> None:
    one = '<motor joint="j1"/>'
    xml = (
        '<mujoco><worldbody><body><joint name="j1" axis="0 1 0" damping="{}"/>'
        '<geom type="sphere" size=".1" pos="0 0 .5" mass="1"/></body></worldbody><actuator>{}</actuator></mujoco>'
    )
    servo = '<position joint="j1" kp="10" kv="2"/>'
    qpos = np.zeros((1, 1))
    made = {key: mujoco.MjModel.from_xml_string(xml.format(*key)) for key in ((0, one), (3, one), (0, servo * 2))}
    own = float(made[0, one].dof_M0[0])
    assert _rates(made[0, one], qpos, True) == 0.0 == _rates(made[3, one], qpos, False)
    assert _rates(made[3, one], qpos, True) == pytest.approx(3.0 / own)
    assert _rates(made[0, servo * 2], qpos, False) == pytest.approx(4.0 / own)


def test_windows_are_asked_under_the_condition_that_they_were_recorded_under() -> None:
    rollouts = [
        replace(rollout, rollout_id=f"r{k}")
        for k, rollout in enumerate(
            [*arm.simulate({}, count=1, seconds=2.0), *arm.simulate({}, count=1, seconds=2.0, gains=(1.0, 3.0))]
        )
    ]
    session = arm.session_of(rollouts)
    windows = arm.problem_of(session, [0, 1], 6).windows
    assert set(windows.condition) == {0, 1}
    rates = damping_rates(session.plant, vary(session.plant, []), windows)
    soft, stiff = (rates[windows.condition == number] for number in (0, 1))
    assert stiff.min() > 2.0 * soft.max()
    euler = _with_integrator(vary(session.plant, []), mujoco.mjtIntegrator.mjINT_EULER)
    assert {int(model.opt.integrator) for model in euler.models} == {int(mujoco.mjtIntegrator.mjINT_EULER)}


def test_sensitivities_are_simulated_in_fine_steps_where_a_joint_comes_to_rest_within_a_coarse_one() -> None:
    """As long as the model lacks what slows the joint down: a rotor, in a model made from a drawing."""
    drawn = re.sub(r'kv="(\d)"', r'kv="1\1"', re.sub(r'armature="[.0-9]+"', 'armature="0"', arm.XML))
    session = arm.session_of(arm.simulate({}, count=1, seconds=4.0, xml=drawn), drawn)
    rotors = [single("armature", joint, 0.5) for joint in arm.JOINTS]
    stiff, slow = arm.problem_of(session, [0], 6), arm.problem_of(session, [0], 6, rotors)
    assert stiff.coarse == stiff.fine < stiff.coarsest
    assert slow.coarse == slow.coarsest == stiff.coarsest


def test_a_joints_own_damping_calls_for_fine_steps_too() -> None:
    """An arm whose motors are told torques has the damping in its model, and not the rotors."""
    drawn = re.sub(r'armature="[.0-9]+"', 'armature="0" damping="20"', arm.XML)
    drawn = re.sub(r'kv="\d+"', 'kv="0"', drawn)
    session = arm.session_of(arm.simulate({}, count=1, seconds=4.0, xml=drawn), drawn)
    problem = arm.problem_of(session, [0], 6)
    assert problem.coarse == problem.fine < problem.coarsest
