"""Every corruption of a floating base is found, with motion capture and without; good robots raise nothing."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bumblebee.measured.rollout import Rollout
from tests.measured.checks.changes import Change, edit, fatal_rules, findings, scale
from tests.measured.simulated import g1_rollout


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("size", [0.0, 0.05, 0.15, 0.5, 1.5])
def test_a_good_floating_robot_raises_nothing_still_swaying_falling_or_thrashing(seed: int, size: float) -> None:
    assert findings(g1_rollout(seed, size, seconds=3.0)) == []


def test_a_good_robot_without_noise_raises_nothing() -> None:
    rollout = g1_rollout(1, 0.3)
    assert findings(replace(rollout, joint_pos=np.round(rollout.joint_pos, 3))) == []  # a coarse encoder


def test_a_target_that_balances_against_the_motion_is_no_reversed_sign() -> None:
    """Feedback makes command and position anticorrelated; the response itself is still the right way round."""
    assert not any(f.rule == "response-sign" for seed in range(4) for f in findings(g1_rollout(seed, 0.5)))


def turned(rollout: Rollout) -> np.ndarray:
    """base_lin_vel in the world frame, by MuJoCo's own rotation."""
    out = np.zeros((rollout.frames, 3))
    for row in range(rollout.frames):
        mujoco.mju_rotVecQuat(out[row], rollout.base_lin_vel[row], rollout.base_quat[row])
    return out


def gyro_in_world(rollout: Rollout) -> np.ndarray:
    out = np.zeros((rollout.frames, 3))
    for row in range(rollout.frames):
        mujoco.mju_rotVecQuat(out[row], rollout.base_ang_vel[row], rollout.base_quat[row])
    return out


G1_CHANGES: dict[str, tuple[Change, str, str]] = {
    "xyzw": (lambda r: replace(r, base_quat=np.roll(r.base_quat, -1, axis=1)), "quaternion-order", "base_quat"),
    "not unit": (lambda r: replace(r, base_quat=2 * r.base_quat), "quaternion-norm", "base_quat"),
    "world velocity": (lambda r: replace(r, base_lin_vel=turned(r)), "velocity-frame", "base_lin_vel"),
    "world gyro": (lambda r: replace(r, base_ang_vel=gyro_in_world(r)), "velocity-frame", "base_ang_vel"),
    "gyro in degrees": (lambda r: replace(r, base_ang_vel=57.3 * r.base_ang_vel), "degrees", "base_ang_vel"),
    "gyro reversed": (lambda r: replace(r, base_ang_vel=-r.base_ang_vel), "gyro-sign", "base_ang_vel"),
    "no gyro": (lambda r: replace(r, base_ang_vel=None), "base-columns", "base_ang_vel"),
    "frozen gyro": (
        edit("base_ang_vel", lambda w: w.__setitem__(slice(20, None), w[20])),
        "frozen",
        "base_ang_vel",
    ),
    "degrees": (scale("joint_pos", 180 / np.pi), "degrees", "joint_pos"),
}


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", G1_CHANGES)
def test_each_corruption_of_a_floating_base_is_found(name: str, seed: int) -> None:
    change, rule, column = G1_CHANGES[name]
    found = fatal_rules(change(g1_rollout(seed, 0.5, heading=1.0 + 2 * seed)))
    assert any(broken == rule and place.startswith(column) for broken, place in found), found


@pytest.mark.parametrize("seed", range(3))
def test_a_still_base_in_xyzw_is_pointed_out_though_nothing_decides_it(seed: int) -> None:
    rollout = g1_rollout(seed, 0.0, heading=0.0)
    found = findings(replace(rollout, base_quat=np.roll(rollout.base_quat, -1, axis=1)))
    assert {(finding.rule, finding.column) for finding in found} == {("quaternion-order", "base_quat")}


@pytest.mark.parametrize("column", ["base_quat", "base_ang_vel", "base_lin_vel"])
def test_a_floating_base_needs_its_columns(column: str) -> None:
    assert ("base-columns", column) in fatal_rules(replace(g1_rollout(0, 0.1), **{column: None}))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("size", [0.3, 0.6])
def test_without_motion_capture_the_standing_foot_tells_the_frame(seed: int, size: float) -> None:
    """Fatal for a world-frame velocity, nothing for the right one."""
    rollout = replace(g1_rollout(seed, size, heading=2.0 + 0.5 * seed), base_pos=None)
    assert findings(rollout) == []
    assert ("velocity-frame", "base_lin_vel") in fatal_rules(replace(rollout, base_lin_vel=turned(rollout)))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("size", [0.0, 0.1, 1.5])
def test_without_motion_capture_good_robots_raise_nothing(seed: int, size: float) -> None:
    assert findings(replace(g1_rollout(seed, size), base_pos=None)) == []
