"""Rollouts that state their gains, loads and voltages are simulated by them, each by its own, all together."""

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.simulation import choose_starts, cut, residuals, vary
from bumblebee.sim.effects import single
from tests.diagnosis import servo_at_gains as servo
from tests.diagnosis.arm import session_of
from tests.diagnosis.servo_at_gains import Setting, Truth

GAINS = [Setting(kp=0.4), Setting(kp=1.0), Setting(kp=2.5, kd=0.08)]
LOADS = [Setting(), Setting(load=0.2), Setting(load=0.4, at=0.15)]


def errors(session, effects=(), column: int = 0) -> np.ndarray:
    """RMS error (R,) of each rollout after 0.2 s [rad], of the joint of a column."""
    starts = choose_starts(session.rollouts, range(len(session.rollouts)), 0.2, 60)
    windows = cut(session.plant, session.layout, session.rollouts, starts)
    left = residuals(session.plant, session.layout, windows, [vary(session.plant, effects)], 0.001)[0, :, -1, column]
    return np.array([np.sqrt(np.mean(left[windows.rollout == i] ** 2)) for i in range(len(session.rollouts))])


@pytest.mark.parametrize("drive", [servo.SERVO, servo.MOTOR], ids=["servo", "motor"])
@pytest.mark.parametrize("settings", [GAINS, [GAINS[2], GAINS[0]], [GAINS[0]]], ids=["three", "two", "one"])
def test_each_rollout_is_simulated_by_its_own_gains(drive: str, settings: list[Setting]) -> None:
    session = session_of(servo.record(settings), servo.xml(drive))
    assert not session.set_aside
    assert errors(session).max() < 5e-3


def test_gains_that_are_not_stated_are_the_declared_ones() -> None:
    rollouts = servo.record([Setting(kp=2.5, stated=False)])
    assert errors(session_of(rollouts, servo.xml())).min() > 0.02


@pytest.mark.parametrize("effect", ["motor_strength", "stribeck_friction", "torque_lag", "torque_speed_limit"])
def test_factors_and_hooks_act_on_each_rollouts_own_gains(effect: str) -> None:
    rollouts = servo.record(GAINS, Truth(strength=0.7 if effect == "motor_strength" else 1.0))
    values = {"motor_strength": (0.7,), "stribeck_friction": (1e-9, 0.1), "torque_lag": (1e-5,)}
    effects = [single(effect, "hip", *values.get(effect, (1e6,)))]
    assert errors(session_of(rollouts, servo.xml()), effects).max() < 5e-3


@pytest.mark.parametrize("kind", ["backlash", "series_elasticity"])
def test_a_second_hinge_is_put_into_every_conditions_model(kind: str) -> None:
    session = session_of(servo.record([*GAINS, *LOADS]), servo.xml())
    stiff = {"backlash": (1e-7, 0.0), "series_elasticity": (1e4, 0.0, 1e-3, 0.0)}
    assert errors(session, [single(kind, "hip", *stiff[kind])]).max() < 8e-3


def test_an_added_mass_is_in_the_rollouts_that_state_it() -> None:
    rollouts = servo.record(LOADS)
    assert errors(session_of(rollouts, servo.xml())).max() < 5e-3
    unsaid = [r.__class__(**{**vars(r), "meta": {}}) for r in rollouts]
    assert errors(session_of(unsaid, servo.xml()))[2:].min() > 0.02


def test_a_body_that_was_weighed_anew_keeps_the_mass_that_was_added_to_it() -> None:
    session = session_of(servo.record(LOADS), servo.xml())
    models = vary(session.plant, [single("link_mass", "link", 0.6, 0.0)]).models
    total = [float(model.body_subtreemass[0]) for model in models]
    assert total == pytest.approx([0.6, 0.8, 1.0])


def test_a_voltage_scales_the_torque_limit_where_the_model_declares_the_nominal_one() -> None:
    rollouts = servo.record([Setting(kp=8.0), Setting(kp=8.0, supply=0.3)])
    declared = servo.xml(custom='<numeric name="nominal_voltage" data="12"/>')
    assert errors(session_of(rollouts, declared)).max() < 5e-3
    assert errors(session_of(rollouts, servo.xml()))[2:].max() > 0.02  # a label alone


def test_a_limit_that_was_found_scales_with_the_voltage() -> None:
    rollouts = servo.record([Setting(kp=8.0), Setting(kp=8.0, supply=0.3)])
    high = servo.xml(custom='<numeric name="nominal_voltage" data="12"/>').replace(
        f'forcerange="-{servo.LIMIT} {servo.LIMIT}"', 'forcerange="-9 9"'
    )
    found = [single("torque_limit", "hip", servo.LIMIT)]
    assert errors(session_of(rollouts, high)).max() > 0.02
    assert errors(session_of(rollouts, high), found).max() < 5e-3


def test_one_condition_for_all_changes_no_bit() -> None:
    plain = session_of(servo.record([Setting(stated=False)]), servo.xml())
    stated = session_of(servo.record([Setting()]), servo.xml())
    assert not stated.plant.others
    assert np.array_equal(errors(plain), errors(stated))


def test_what_cannot_be_had_is_set_aside_with_its_reason() -> None:
    rollouts = servo.record([Setting(), Setting(load=0.1)])
    lost = {"conditions": {"added_mass": [{"body": "tail", "kg": 1.0, "position": [0, 0, 0]}]}}
    rollouts[-1] = rollouts[-1].__class__(**{**vars(rollouts[-1]), "meta": lost})
    session = session_of(rollouts, servo.xml())
    assert [entry["rollout"] for entry in session.set_aside] == ["r03"]
    assert "tail" in session.set_aside[0]["reason"]
    assert len(session.rollouts) == 3


def test_motors_of_rollouts_that_state_no_gains_are_set_aside_if_the_others_differ() -> None:
    unsaid = Setting(stated=False)
    session = session_of(servo.record([unsaid, *GAINS], each=1), servo.xml(servo.MOTOR))
    assert [entry["rollout"] for entry in session.set_aside] == ["r00"]
    session = session_of(servo.record([unsaid, Setting(), Setting()], each=1), servo.xml(servo.MOTOR))
    assert not session.set_aside
    assert errors(session).max() < 5e-3


def test_a_model_of_a_fixed_total_mass_takes_no_load() -> None:
    fixed = servo.xml().replace('angle="radian"', 'angle="radian" settotalmass="0.5"')
    session = session_of(servo.record(LOADS), fixed)
    assert len(session.set_aside) == 4
    assert "settotalmass" in session.set_aside[0]["reason"]


def test_models_under_all_conditions_have_one_layout() -> None:
    session = session_of(servo.record([*GAINS, *LOADS], each=1), servo.xml())
    models = [plant.model for plant in session.plant.every]
    assert len(models) == 5  # two settings are as declared
    assert len({(m.nq, m.nv, m.nbody, m.nu) for m in models}) == 1
    assert isinstance(models[0], mujoco.MjModel)
