"""A joint that its neighbour swings against its own torque keeps its sign; one that is truly reversed does not."""

from dataclasses import replace
from functools import cache

import mujoco
import numpy as np
import pytest

from bumblebee.measured.checks import Finding, Thresholds, check_rollout
from bumblebee.measured.checks.reversed_command import share_for_reversed
from bumblebee.measured.checks.view import View
from bumblebee.measured.rollout import Rollout

TURNTABLE = """<mujoco><compiler angle="radian"/><option timestep=".001"/><worldbody><body name="table">
<joint name="turn" axis="0 0 1" damping=".11" armature=".006"/>
<inertial pos=".07 -.08 .1" mass=".3" diaginertia=".006 .006 .006"/>
<body name="spinner" pos=".29 .12 .09"><joint name="spin" axis="1 0 0" damping=".03" armature=".0013"/>
<inertial pos="-.1 -.16 .17" mass=".23" diaginertia=".0046 .0046 .0046"/></body></body></worldbody>
<actuator>DRIVES</actuator></mujoco>"""
JOINTS = ("turn", "spin")


@cache
def model(servo: bool = False) -> mujoco.MjModel:
    drive = '<position joint="{}" kp="4" kv=".1"/>' if servo else '<motor joint="{}"/>'
    return mujoco.MjModel.from_xml_string(TURNTABLE.replace("DRIVES", "".join(drive.format(j) for j in JOINTS)))


@cache
def record(seed: int, servo: bool = False, hz: int = 100, seconds: float = 10.0) -> Rollout:
    """A spinner that tumbles on a turntable, both under waves."""
    rng, robot = np.random.default_rng(seed), model(servo)
    data, time = mujoco.MjData(robot), np.arange(round(seconds * hz)) / hz
    waves = np.sin(2 * np.pi * rng.uniform(0.3, 2.0, (3, 2)) * time[:, None, None] + rng.uniform(0, 6.28, (3, 2)))
    command = (rng.uniform(0.3, 1.0, (3, 2)) * waves).sum(axis=1) * rng.uniform([0.3, 1.0], [1.0, 1.6])
    states = []
    for value in command:
        states.append(np.concatenate((data.qpos, data.qvel)))
        data.ctrl[:] = value
        mujoco.mj_step(robot, data, round(1000 / hz))
    q, v = np.split(np.array(states), 2, axis=1)
    noisy = q + 5e-4 * rng.standard_normal(q.shape), v + 0.01 * rng.standard_normal(v.shape)
    columns = {"joint_target" if servo else "joint_torque_cmd": command}
    return Rollout("r", JOINTS, float(hz), time, *noisy, **columns)


def signs(rollout: Rollout, servo: bool = False) -> list[Finding]:
    return [f for f in check_rollout(rollout, model(servo)) if f.rule == "response-sign"]


def reversed_in(rollout: Rollout, joint: int) -> Rollout:
    column = "joint_torque_cmd" if rollout.joint_target is None else "joint_target"
    command = getattr(rollout, column).copy()
    command[:, joint] *= -1
    return replace(rollout, **{column: command})


SWUNG = (6, 67, 151)


@pytest.mark.parametrize("seed", SWUNG)
def test_a_joint_that_its_neighbour_drives_against_its_torque_is_pointed_out_and_used(seed: int) -> None:
    found = signs(record(seed))
    assert found and not any(f.fatal for f in found)


@pytest.mark.parametrize("servo", [False, True])
@pytest.mark.parametrize("joint", [0, 1])
def test_the_model_tells_a_joint_that_is_truly_reversed(servo: bool, joint: int) -> None:
    """Asked of the model alone: the regression does not see every one of them."""
    for seed in range(3):
        rollout = record(seed, servo)
        assert share_for_reversed(View("r", rollout, model(servo), None, Thresholds()), joint, servo) < 0.2
        turned = reversed_in(rollout, joint)
        assert share_for_reversed(View("r", turned, model(servo), None, Thresholds()), joint, servo) > 0.6


def test_a_reversed_target_beside_a_tumbling_neighbour_is_refused() -> None:
    refused = [signs(reversed_in(record(seed, True), 0), True) for seed in range(3)]
    assert all(any(f.fatal and "turn" in f.column for f in found) for found in refused)


@pytest.mark.parametrize("joint", [0, 1])
def test_a_servo_before_a_gear_is_the_servo_behind_it(joint: int) -> None:
    """Its gains at the joint are those at the motor times the square of the gear; they were, twice."""
    text = TURNTABLE.replace(
        "DRIVES", "".join(f'<position joint="{name}" gear="20" kp=".01" kv=".00025"/>' for name in JOINTS)
    )
    geared = mujoco.MjModel.from_xml_string(text)
    for rollout in (record(0, True), reversed_in(record(0, True), joint)):
        plain, before = (
            share_for_reversed(View("r", rollout, m, None, Thresholds()), joint, True) for m in (model(True), geared)
        )
        assert before == pytest.approx(plain)


FAR = {"damped": ('damping=".11"', 'damping="5"', 6), "turned": ('axis="1 0 0"', 'axis="0 1 0"', 6)}


@pytest.mark.parametrize("name", FAR)
def test_a_model_that_is_too_far_off_to_tell_sets_nothing_aside(name: str) -> None:
    """Damping fifty times too large, an axis that is another: the nearer prediction misses by more than the sign."""
    old, new, seed = FAR[name]
    text = TURNTABLE.replace("DRIVES", "".join(f'<motor joint="{j}"/>' for j in JOINTS)).replace(old, new)
    far = mujoco.MjModel.from_xml_string(text.replace('damping=".03"', 'damping="3"') if name == "damped" else text)
    view = View("r", record(seed), far, None, Thresholds())
    assert share_for_reversed(view, 0, by_target=False) is None
    found = [f for f in check_rollout(record(seed), far) if f.rule == "response-sign"]
    assert found and not any(f.fatal for f in found)
