"""On a floating base the sign of a command is told by what a limb that touches nothing asks of its joint."""

from dataclasses import replace
from functools import cache

import mujoco
import numpy as np
import pytest

from bumblebee.measured.checks import Thresholds, check_rollout
from bumblebee.measured.checks.reversed_command import share_for_reversed
from bumblebee.measured.checks.view import View
from bumblebee.measured.rollout import Rollout

ROBOT = """<mujoco><compiler angle="radian"/><option timestep=".001"/><worldbody>
<geom type="plane" size="5 5 .1"/><body name="pelvis" pos="0 0 .52"><freejoint/>
<geom type="box" size=".1 .1 .05" mass="4" contype="0" conaffinity="0"/>
<body name="leg" pos="0 0 -.05"><joint name="hip" axis="0 1 0" damping="1" armature=".02"/>
<geom type="capsule" size=".03" fromto="0 0 0 0 0 -.4" mass="2" contype="0" conaffinity="0"/>
<geom type="box" size=".25 .2 .02" pos="0 0 -.45" mass="2"/></body>
<body name="trunk" pos="0 0 .05"><joint name="waist" axis="0 1 0" damping=".5" armature=".02"/>
<geom type="capsule" size=".05" fromto="0 0 0 0 0 .4" mass="3" contype="0" conaffinity="0"/></body></body></worldbody>
<actuator><position joint="hip" kp="800" kv="20"/><position joint="waist" kp="60" kv="2"/></actuator></mujoco>"""
JOINTS = ("hip", "waist")


@cache
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(ROBOT)


@cache
def record(seed: int, seconds: float = 6.0, hz: int = 100) -> Rollout:
    """A robot on one broad foot that leans its trunk about, against how it falls, and sways on its hip."""
    rng, data = np.random.default_rng(seed), mujoco.MjData(model())
    time = np.arange(round(seconds * hz)) / hz
    waves = np.sin(2 * np.pi * rng.uniform(0.3, 1.5, (3, 2)) * time[:, None, None] + rng.uniform(0, 6.28, (3, 2)))
    wanted = (waves * [0.005, 0.1]).sum(axis=1)
    rows, targets = [], []
    for one in wanted:
        rows.append(np.concatenate((data.qpos, data.qvel)))
        targets.append(one - [0.0, 0.3 * (data.qpos[8] - one[1])])
        data.ctrl[:] = targets[-1]
        mujoco.mj_step(model(), data, round(1000 / hz))
    place, speed = np.split(np.array(rows), [9], axis=1)
    return Rollout(
        "r", JOINTS, float(hz), time, place[:, 7:] + 1e-3 * rng.standard_normal((len(time), 2)),
        speed[:, 6:] + 0.02 * rng.standard_normal((len(time), 2)), joint_target=np.array(targets),
        base_pos=place[:, :3], base_quat=place[:, 3:7], base_ang_vel=speed[:, 3:6],
    )  # fmt: skip


def share(rollout: Rollout, joint: int) -> float | None:
    return share_for_reversed(View("r", rollout, model(), None, Thresholds()), joint, by_target=True)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_trunk_on_a_floating_base_tells_its_sign(seed: int) -> None:
    rollout = record(seed)
    assert np.ptp(rollout.joint_pos[:, 1]) > 0.2
    assert share(rollout, 1) < 0.3
    assert share(replace(rollout, joint_target=rollout.joint_target * [1, -1]), 1) > 0.7


def test_the_leg_that_the_robot_stands_on_tells_nothing() -> None:
    assert share(record(0), 0) is None


def test_without_the_direction_of_the_base_nothing_is_told() -> None:
    assert share(replace(record(0), base_quat=None), 1) is None


def test_a_trunk_that_goes_by_its_command_turned_round_is_pointed_out_and_a_person_decides() -> None:
    turned = replace(record(0), joint_target=record(0).joint_target * [1, -1])
    found = [f for f in check_rollout(turned, model()) if f.rule == "response-sign"]
    assert [f.column for f in found] == ["joint_target[waist]"]
    assert not [f for f in check_rollout(record(0), model()) if f.rule == "response-sign"]
