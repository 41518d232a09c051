"""Targets of the motor beside positions of the joint are found and named; far targets of a soft servo are not."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.measured.checks import Finding, Thresholds, check_rollout
from bumblebee.measured.rollout import Rollout
from tests.measured.simulated import arm_model, arm_rollout, clip_rollout, g1_model

PENDULUM = """<mujoco><compiler angle="radian"/><option timestep=".001"/><worldbody><body>
<joint name="swing" axis="0 1 0" range="-1 1" damping=".05" armature=".01"/>
<geom type="capsule" fromto="0 0 0 0 0 -.3" size=".03" mass=".8"/></body></worldbody>
<actuator><position joint="swing" kp=".1" kv=".1"/></actuator></mujoco>"""
LIFT = """<mujoco><option timestep=".001"/><worldbody><body>
<joint name="lift" type="slide" axis="0 0 1" range="-.1 .1" limited="true" damping="5"/>
<geom size=".05" mass="1"/></body></worldbody>
<actuator><position joint="lift" kp="4000" kv="100"/></actuator></mujoco>"""


def scales(rollout: Rollout, model: mujoco.MjModel, **limits: float) -> list[Finding]:
    return [f for f in check_rollout(rollout, model, limits=Thresholds(**limits)) if f.rule == "target-scale"]


def times(rollout: Rollout, factor: float | list[float]) -> Rollout:
    assert rollout.joint_target is not None
    return replace(rollout, joint_target=rollout.joint_target * np.array(factor))


def followed(xml: str, feed_forward: float, size: float) -> tuple[Rollout, mujoco.MjModel]:
    """One joint that follows slow waves; its target leads by `feed_forward` times the torque that holds it."""
    model, time = mujoco.MjModel.from_xml_string(xml), np.arange(800) / 100
    data, held, states, targets = mujoco.MjData(model), mujoco.MjData(model), [], []
    for now in time:
        wanted = size * np.sin(2 * np.pi * 0.2 * now)
        held.qpos[:] = wanted
        mujoco.mj_forward(model, held)
        data.ctrl[:] = wanted + feed_forward * held.qfrc_bias / model.actuator_gainprm[0, 0]
        states.append((data.qpos[0], data.qvel[0]))
        targets.append(data.ctrl.copy())
        mujoco.mj_step(model, data, 10)
    q, v = np.array(states).T[:, :, None]
    return Rollout("r", (model.joint(0).name,), 100.0, time, q, v, joint_target=np.array(targets)), model


@pytest.mark.parametrize("seed", range(3))
def test_targets_of_the_motors_are_fatal_and_the_key_is_named(seed: int) -> None:
    rollout = arm_rollout(seed, seconds=12.0)
    assert scales(rollout, arm_model()) == []
    found = scales(times(rollout, 10.0), arm_model())
    assert found and all(f.fatal for f in found)
    told = float(found[0].expected.removesuffix(")").split("about ")[1])
    assert "scale of joint_target" in found[0].expected and told == pytest.approx(0.1, rel=0.4)
    assert "of the motor, before its gear" in found[0].came


def test_one_joint_is_named_alone() -> None:
    found = scales(times(arm_rollout(0, seconds=12.0), [1.0, 20.0, 1.0]), arm_model())
    assert [f.column for f in found] == ["joint_target[elbow]"]


def test_millimetres_of_a_slide_are_named() -> None:
    rollout, model = followed(LIFT, 1.0, 0.05)
    assert scales(rollout, model) == []
    (found,) = scales(times(rollout, 1000.0), model)
    assert found.came.endswith("or mm?")


def test_far_targets_of_a_soft_servo_are_feed_forward() -> None:
    """Its targets are a dozen times its positions, beyond the range; the model knows the torque that holds it."""
    rollout, model = followed(PENDULUM, 1.0, 0.6)
    assert scales(rollout, model) == []
    assert scales(rollout, model, scale_model=0.0)


def test_on_a_floating_base_the_torque_that_is_asked_decides() -> None:
    """Contacts are in no log; no servo gives many times its limit."""
    rollout = clip_rollout("squat_shallow")
    assert scales(rollout, g1_model()) == []
    found = scales(times(rollout, 10.0), g1_model())
    assert {"joint_target[left_knee_joint]", "joint_target[right_knee_joint]"} <= {f.column for f in found}
    assert scales(times(rollout, 10.0), g1_model(), scale_torque=1e9) == []


def test_torques_beside_targets_are_what_acts() -> None:
    rollout = times(arm_rollout(0, seconds=12.0), 10.0)
    torque = np.zeros_like(rollout.joint_pos)
    assert scales(replace(rollout, joint_torque_cmd=torque), arm_model()) == []
