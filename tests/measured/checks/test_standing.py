"""A servo that sticks is no broken log; a reading or a logger that stopped is one."""

from dataclasses import replace
from functools import cache

import mujoco
import numpy as np
import pytest

from bumblebee.measured.checks import check_rollout
from bumblebee.measured.rollout import Rollout

STEP = 1.5e-3  # rad, of a coarse encoder
TWO = """<mujoco><compiler angle="radian"/><option timestep=".001"/><worldbody>
<body><joint name="hip" axis="0 1 0" armature=".02" damping=".05"/>
<geom type="capsule" size=".02" fromto="0 0 0 0 0 -.2" mass=".3"/>
<body pos=".2 0 0"><joint name="knee" axis="0 1 0" armature=".02" damping=".05"/>
<geom type="capsule" size=".02" fromto="0 0 0 0 0 -.2" mass=".2"/></body></body></worldbody>EQUALITY
<actuator><position joint="hip" kp="1.5"/><position joint="knee" kp="1.5"/></actuator></mujoco>"""
TIED = '<equality><joint joint1="hip" joint2="knee" polycoef="0 1 0 0 0"/></equality>'
JOINTS = ("hip", "knee")


@cache
def model(tied: bool = False) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(TWO.replace("EQUALITY", TIED if tied else ""))


@cache
def record(friction: float, size: float = 0.5, tied: bool = False, hz: int = 100, seconds: float = 12.0) -> Rollout:
    """Slow waves of a low-gain servo with dry friction, read by coarse encoders and coarser velocities."""
    robot = mujoco.MjModel.from_xml_string(TWO.replace("EQUALITY", TIED if tied else ""))
    robot.dof_frictionloss[:] = friction
    robot.dof_solref[:], robot.dof_solimp[:, :2] = (0.002, 1.0), (0.99, 0.9999)
    data, time = mujoco.MjData(robot), np.arange(round(seconds * hz)) / hz
    target = size * np.sin(2 * np.pi * 0.12 * time[:, None] + [0.0, 0.4])
    states = []
    for command in target:
        states.append(np.concatenate((data.qpos, data.qvel)))
        data.ctrl[:] = command
        mujoco.mj_step(robot, data, round(1 / hz / robot.opt.timestep))
    q, v = np.split(np.array(states), 2, axis=1)
    coarse = np.round(q / STEP) * STEP, np.round(v / 0.02) * 0.02
    return Rollout("r", JOINTS, float(hz), time, *coarse, joint_target=target)


def frozen(rollout: Rollout, fatal: bool, tied: bool = False) -> set[str]:
    return {f.column for f in check_rollout(rollout, model(tied)) if f.rule == "frozen" and f.fatal == fatal}


def held(rollout: Rollout, columns: tuple[str, ...], joints: slice | int, rows: slice) -> Rollout:
    """The readings of some joints repeated through some rows."""
    changed = {}
    for column in columns:
        values = getattr(rollout, column).copy()
        values[rows, joints] = values[rows.start, joints]
        changed[column] = values
    return replace(rollout, **changed)


def test_a_low_gain_servo_that_sticks_for_seconds_is_used_and_pointed_out() -> None:
    rollout = record(0.35)
    still = np.diff(rollout.joint_pos, axis=0) == 0
    runs = np.diff(np.flatnonzero(~still[:, 0]))
    assert runs.max() > 200 and np.ptp(rollout.joint_target[:200, 0]) > 0.3  # 2 s, while the command moves
    assert [f for f in check_rollout(rollout, model()) if f.fatal] == []
    assert frozen(rollout, fatal=False)


@pytest.mark.parametrize("rows", [slice(500, 700), slice(700, None)])
def test_a_reading_that_stands_while_its_velocity_says_that_it_moves_is_dead(rows: slice) -> None:
    assert frozen(held(record(0.0), ("joint_pos",), 0, rows), fatal=True) == {"joint_pos[hip]"}


def test_a_reading_that_stands_far_beyond_the_errors_at_which_its_joint_moves_is_dead() -> None:
    """Position and the velocity that is made of it: the end of a file of a stiff servo's dead encoder."""
    rollout = record(0.0)
    stiff = replace(rollout, joint_target=rollout.joint_pos + 0.02 * np.sin(np.arange(rollout.frames))[:, None])
    dead = held(stiff, ("joint_pos", "joint_vel"), 0, slice(430, None))
    dead.joint_vel[430:, 0] = 0.0
    assert frozen(dead, fatal=True) == {"joint_pos[hip]"}


def test_a_joint_that_stands_while_the_joint_that_is_tied_to_it_moves_is_dead() -> None:
    rollout = record(0.0, size=1.5, tied=True)
    dead = held(rollout, ("joint_pos", "joint_vel"), 0, slice(500, 700))
    dead.joint_vel[500:700, 0] = 0.0
    assert frozen(dead, fatal=True, tied=True) == {"joint_pos[hip]"}


def test_a_logger_that_repeats_its_readings_is_dead_though_each_joint_might_stick() -> None:
    rollout = record(0.35)
    rollout = replace(rollout, joint_vel=rollout.joint_vel + 1e-3 * np.random.default_rng(0).standard_normal((1200, 2)))
    assert frozen(rollout, fatal=True) == set()
    assert "joint_pos" in frozen(held(rollout, ("joint_pos", "joint_vel"), slice(None), slice(150, 400)), fatal=True)
