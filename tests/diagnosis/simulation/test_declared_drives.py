"""Joint force ranges, damping ratios and cut delays, as robot makers publish them, mean what MuJoCo makes of them."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from bumblebee.diagnosis.candidates import all_candidates
from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.output import corrected_xml
from bumblebee.diagnosis.simulation import declared_values, plant_servos, vary
from bumblebee.measured.checks import Thresholds
from bumblebee.measured.checks.reversed_command import torque_limits
from bumblebee.measured.checks.view import View
from bumblebee.measured.model_file import load_model
from bumblebee.sim.effects import single
from bumblebee.sim.sensors import load_spec
from tests.diagnosis import arm
from tests.diagnosis import servo_at_gains as servo
from tests.diagnosis.arm import session_of
from tests.diagnosis.servo_at_gains import Setting
from tests.diagnosis.simulation.test_conditions import errors

VOLTAGE = '<numeric name="nominal_voltage" data="12"/>'


def published(limit: float, custom: str = "") -> str:
    """The servo's model, its limit stated at the joint."""
    plain = servo.SERVO.replace(f' forcerange="-{servo.LIMIT} {servo.LIMIT}"', "")
    return servo.xml(plain, custom).replace('name="hip"', f'name="hip" actuatorfrcrange="-{limit} {limit}"')


def with_ratio(xml: str, ratio: float) -> str:
    return xml.replace(f'kv="{servo.KD}"', f'dampratio="{ratio}"')


def ratio_of_kd() -> float:
    """The damping ratio that MuJoCo resolves to `servo.KD`."""
    model = mujoco.MjModel.from_xml_string(with_ratio(servo.xml(), 1.0))
    return servo.KD / -model.actuator_biasprm[0, 2]


def test_a_joints_force_range_is_the_drives_limit_in_values_torques_and_candidates() -> None:
    session = session_of(servo.record([Setting(kp=8.0)]), published(2.5))
    assert declared_values(session.plant, "torque_limit", "hip") == (2.5,)
    assert plant_servos(session.plant).limit[0] == 2.5
    candidates = all_candidates(session.plant, session.rollouts, [])
    assert "torque_speed_limit" in {c.effect for c in candidates}
    assert max(c.start[0] for c in candidates if c.effect == "torque_limit") <= 2.5


def test_a_joints_force_range_scales_with_the_voltage() -> None:
    rollouts = servo.record([Setting(kp=8.0), Setting(kp=8.0, supply=0.3)])
    assert errors(session_of(rollouts, published(servo.LIMIT, VOLTAGE))).max() < 5e-3


@pytest.mark.parametrize("declared", [9.0, 0.8])
def test_a_limit_that_was_found_replaces_a_joints_force_range_whichever_is_larger(declared: float) -> None:
    session = session_of(servo.record([Setting(kp=8.0)]), published(declared))
    found = [single("torque_limit", "hip", servo.LIMIT)]
    assert errors(session).max() > 0.02
    assert errors(session, found).max() < 5e-3
    written = mujoco.MjModel.from_xml_string(corrected_xml(session.spec, found)[0])
    assert written.actuator_forcerange[0].tolist() == [-servo.LIMIT, servo.LIMIT]
    assert not written.jnt_actfrclimited.any()


def test_the_checks_of_signs_know_a_joints_force_range(tmp_path: Path) -> None:
    (tmp_path / "model.xml").write_text(published(2.5))
    view = View("r", servo.record([Setting()])[0], load_model(tmp_path / "model.xml"), None, Thresholds())
    assert torque_limits(view).tolist() == [2.5]


def resolved(session: Session) -> set[float]:
    """Every kd that the plants of a session and their structural variants have, rounded."""
    stiff = vary(session.plant, [single("series_elasticity", "hip", 50.0, 0.0, 1e-3, 0.0)])
    models = [*(plant.model for plant in session.plant.every), *stiff.models]
    return {round(float(-model.actuator_biasprm[0, 2]), 4) for model in models}


def test_a_damping_ratio_means_the_gain_of_the_declared_model_under_loads_and_shafts_and_in_the_written_model() -> None:
    rollouts = servo.record([Setting(), Setting(load=0.2)])
    session = session_of(rollouts, with_ratio(servo.xml(), ratio_of_kd()))
    assert len(session.plant.every) == 2  # the stated gains are the declared ones
    assert resolved(session) == {servo.KD}
    assert errors(session).max() < 5e-3
    armature = [single("armature", "hip", 0.05)]
    written = mujoco.MjModel.from_xml_string(corrected_xml(session.spec, armature)[0])
    assert written.actuator_biasprm[0, 2] == pytest.approx(-servo.KD, rel=1e-4)


def test_logs_of_a_model_whose_delay_is_cut_by_its_buffer_are_predicted_by_it() -> None:
    cut = arm.XML.replace('kp="60"', 'delay=".1" nsample="4" kp="60"')
    session = session_of(arm.simulate({("command_delay", "j2"): 0.02}), cut)
    assert session.plant.delay.tolist() == [0.0, 0.02, 0.0]
    assert any("delay of 0.1 s is longer than its buffer (nsample 4)" in note for note in session.notes)
    assert errors(session, column=1).max() < 5e-3


def test_a_delay_keeps_its_length_where_training_takes_finer_steps(tmp_path: Path) -> None:
    """A model that a diagnosis wrote has buffers for its own step."""
    spec = load_spec()
    actuator = spec.actuators[0]
    actuator.delay, actuator.nsample, actuator.interp = 0.02, 6, 1
    spec.compile()
    (tmp_path / "model.xml").write_text(spec.to_xml())
    fine = load_spec(tmp_path / "model.xml", physics_hz=1000.0)
    assert fine.actuators[0].nsample * fine.option.timestep >= fine.actuators[0].delay == 0.02
    assert np.count_nonzero([a.nsample for a in fine.actuators]) == 1
