"""Drives in one form: explicit gains, one force limit, delays as MuJoCo applies them; the model moves as it did."""

import mujoco
import numpy as np
import pytest

from bumblebee.robot.drives import explicit_drives
from bumblebee.sim.servo import servos_of

ARM = """<mujoco><compiler angle="radian"/><option timestep=".002" integrator="{integrator}"/>
<default><default class="weak"><joint actuatorfrcrange="-3 3"/></default></default>
<worldbody><body name="link"><joint name="j" axis="0 1 0" armature=".01" damping=".05" {joint}/>
<geom size=".05" pos=".2 0 0" mass="1"/></body></worldbody><actuator>{actuators}</actuator></mujoco>"""
POSITION = '<position joint="j" kp="40" gear="2" forcerange="-30 30"/>'
VELOCITY = '<velocity joint="j" kv="1.5" gear="4"/>'


def arm(actuators: str, joint: str = "", integrator: str = "implicitfast") -> mujoco.MjSpec:
    return mujoco.MjSpec.from_string(ARM.format(actuators=actuators, joint=joint, integrator=integrator))


def limit(spec: mujoco.MjSpec) -> float:
    return float(servos_of(spec.compile(), [0]).limit[0])


def path(spec: mujoco.MjSpec, command: float = 1.5, column: int = 0) -> np.ndarray:
    """Positions and speeds (300, 2) under a command that changes its sign."""
    model = spec.compile()
    data, out = mujoco.MjData(model), []
    for k in range(300):
        data.ctrl[column] = command if k % 100 < 50 else -command
        mujoco.mj_step(model, data)
        out.append((data.qpos[0], data.qvel[0]))
    return np.array(out)


@pytest.mark.parametrize(
    ("actuator", "joint", "effective"),
    [
        ('<position joint="j" kp="80" kv="4"/>', 'actuatorfrcrange="-3 3"', 3.0),
        ('<position joint="j" kp="80" kv="4"/>', 'class="weak"', 3.0),
        ('<position joint="j" kp="80" kv="4" forcerange="-2 2"/>', 'actuatorfrcrange="-3 3"', 2.0),
        ('<position joint="j" kp="80" kv="4" forcerange="-5 5"/>', 'actuatorfrcrange="-3 3"', 3.0),
        ('<position joint="j" kp="80" kv="4" gear="-2"/>', 'actuatorfrcrange="-3 3"', 3.0),
        ('<motor joint="j" gear="10" ctrlrange="-1 1"/>', 'actuatorfrcrange="-3 3"', 3.0),
        ('<motor joint="j" gear="10" ctrlrange="-.2 .2"/>', 'actuatorfrcrange="-3 3"', 2.0),
        ('<motor joint="j" ctrlrange="-2 2" forcerange="-5 5"/>', "", 2.0),
        ('<position joint="j" kp="80" kv="4" ctrlrange="-1 1"/>', "", np.inf),
    ],
)
@pytest.mark.parametrize("integrator", ["implicitfast", "Euler"])
def test_the_tightest_of_a_joints_limits_is_the_drives_and_the_model_moves_as_it_did(
    actuator: str, joint: str, effective: float, integrator: str
) -> None:
    declared = arm(actuator, joint, integrator)
    spec, notes = explicit_drives(declared)
    assert limit(spec) == pytest.approx(effective)
    assert not spec.compile().jnt_actfrclimited.any() and not notes
    np.testing.assert_array_equal(path(spec), path(declared))
    assert limit(mujoco.MjSpec.from_string(spec.to_xml())) == pytest.approx(effective)


def test_a_limit_of_the_sum_of_several_drives_stays_the_joints() -> None:
    spec, _ = explicit_drives(arm('<motor joint="j"/><motor joint="j"/>', 'actuatorfrcrange="-3 3"'))
    assert spec.compile().jnt_actfrcrange[0].tolist() == [-3, 3]
    spec, _ = explicit_drives(arm('<motor joint="j"/>', 'actuatorfrcrange="-3 3" actuatorgravcomp="true"'))
    assert spec.compile().jnt_actfrcrange[0].tolist() == [-3, 3]


@pytest.mark.parametrize("order", [(POSITION, VELOCITY), (VELOCITY, POSITION)])
def test_a_damper_beside_a_servo_becomes_its_gain(order: tuple[str, str]) -> None:
    """Joint damping 1.5 * 4^2 = 24 N m s/rad; the motion is that of the two actuators."""
    declared = arm("".join(order))
    spec, notes = explicit_drives(declared)
    servo = servos_of(spec.compile(), [0])
    assert servo.actuator[0] == order.index(POSITION)
    assert servo.bias[0] == pytest.approx([0, -160, -24])
    assert len(notes) == 1 and notes[0].endswith("one torque limit: j")
    ours, theirs = (path(s, 0.1, order.index(POSITION)) for s in (spec, declared))
    np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-9)


def test_a_servo_and_its_damper_share_the_joints_limit() -> None:
    declared = arm('<position joint="j" kp="40"/><velocity joint="j" kv="2"/>', 'actuatorfrcrange="-3 3"')
    spec, _ = explicit_drives(declared)
    assert limit(spec) == 3
    np.testing.assert_allclose(path(spec), path(declared), rtol=1e-6, atol=1e-9)


def test_a_damping_ratio_is_resolved_once_whatever_changes_afterwards() -> None:
    declared = arm('<position joint="j" kp="40" dampratio="1"/>', 'springdamper=".5 1"')
    model = declared.compile()
    spec, _ = explicit_drives(declared)
    spec.joint("j").armature = 0.5
    spec.body("link").geoms[0].mass = 3
    changed = mujoco.MjModel.from_xml_string((spec.compile(), spec.to_xml())[1])
    assert changed.dof_M0[0] > 2 * model.dof_M0[0]
    assert model.actuator_biasprm[0, 2] < 0
    np.testing.assert_allclose(changed.actuator_biasprm, model.actuator_biasprm, rtol=1e-5)
    np.testing.assert_allclose(changed.jnt_stiffness, model.jnt_stiffness, rtol=1e-5)
    np.testing.assert_allclose(changed.dof_damping, model.dof_damping, rtol=1e-5)


def test_the_compiled_damping_is_there_when_a_damper_is_folded_into_a_servo_with_a_ratio() -> None:
    declared = arm('<position joint="j" kp="40" dampratio="1"/><velocity joint="j" kv="1.5"/>')
    of_ratio = declared.compile().actuator_biasprm[0, 2]
    assert explicit_drives(declared)[0].actuators[0].biasprm[2] == pytest.approx(of_ratio - 1.5)


@pytest.mark.parametrize(
    ("options", "delay", "named"),
    [
        ('delay=".03" nsample="5"', 0.01, "declared delay of 0.03 s is longer than its buffer"),
        ('delay=".03" nsample="5" interp="linear"', 0.01, "declared delay of 0.03 s is longer than its buffer"),
        ('delay=".01" nsample="5"', 0.01, ""),
        ('delay=".009" nsample="9"', 0.01, ""),
        ('delay=".009" nsample="9" interp="linear"', 0.009, ""),
    ],
)
def test_a_delay_is_the_one_that_its_buffer_and_steps_allow(options: str, delay: float, named: str) -> None:
    declared = arm(f'<motor name="drive" joint="j" {options}/>')
    spec, notes = explicit_drives(declared)
    assert spec.actuators[0].delay == pytest.approx(delay)
    assert [named in note for note in notes] == [True] * bool(named)
    np.testing.assert_array_equal(path(spec), path(declared))
    model = declared.compile()
    data = mujoco.MjData(model)
    for k in range(40):  # of a ramp the delayed command lags by the delay
        data.ctrl[0] = 0.002 * k
        mujoco.mj_step(model, data)
    assert 0.002 * 39 - data.actuator_force[0] == pytest.approx(delay)


def test_a_second_call_changes_nothing() -> None:
    declared = arm(
        '<position joint="j" kp="40" dampratio="1" delay=".03" nsample="5"/><velocity joint="j" kv="1.5"/>',
        'actuatorfrcrange="-3 3" springdamper=".5 1"',
    )
    once, notes = explicit_drives(declared)
    twice, more = explicit_drives(once)
    assert len(notes) == 2 and not more
    assert (once.compile(), once.to_xml())[1] == (twice.compile(), twice.to_xml())[1]
