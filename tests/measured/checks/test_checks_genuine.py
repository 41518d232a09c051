"""Genuine rollouts of a policy with gravity feed-forward pass, in contact and in falls; mistakes in them do not."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.measured.checks import Finding, Thresholds, check_rollout
from bumblebee.measured.rollout import Rollout
from tests.measured.simulated import clip_and_lead, clip_rollout, g1_model, g1_rollout, tracked_rollout

FAULTS = ("", "weak", "friction", "delay", "offset")
CLIPS = ("bow", "walk_slow", "kick_right", "squat_shallow")


def fatal(rollout: Rollout) -> list[Finding]:
    return [finding for finding in check_rollout(rollout, g1_model()) if finding.fatal]


def fatal_with(rollout: Rollout, **limits: float) -> set[str]:
    found = check_rollout(rollout, g1_model(), limits=Thresholds(**limits))
    return {finding.rule for finding in found if finding.fatal}


def columns(rollout: Rollout, order: list[int]) -> Rollout:
    """The encoders' columns in another order."""
    return replace(rollout, joint_pos=rollout.joint_pos[:, order], joint_vel=rollout.joint_vel[:, order])


def exchanged(rollout: Rollout, first: str, second: str) -> Rollout:
    order = list(range(len(rollout.joints)))
    i, j = rollout.joints.index(first), rollout.joints.index(second)
    order[i], order[j] = j, i
    return columns(rollout, order)


@pytest.mark.parametrize("name", CLIPS)
def test_perfect_tracking_under_feed_forward_targets_passes(name: str) -> None:
    assert np.abs(clip_and_lead(name)[1]).max() > 0.15  # the target leads by enough to matter
    assert fatal(tracked_rollout(name)) == []


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("name", CLIPS)
def test_a_robot_in_contact_passes_whatever_its_motors_do(name: str, fault: str) -> None:
    """Effects that the diagnosis is to find are no faults of the log."""
    assert fatal(clip_rollout(name, fault)) == []


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("name", ["walk_slow", "bow"])
def test_a_robot_that_falls_passes_whole_and_cut_at_the_fall(name: str, fault: str) -> None:
    rollout = clip_rollout(name, fault, held=False)
    assert rollout.base_pos[:, 2].min() < 0.45
    assert fatal(rollout) == []
    short = {column: getattr(rollout, column)[:60] for column in rollout.columns}
    assert fatal(replace(rollout, time=rollout.time[:60], **short)) == []


@pytest.mark.parametrize("fault", ["", "weak", "delay"])
@pytest.mark.parametrize("pair", [("left_knee_joint", "right_knee_joint"), ("left_hip_pitch_joint", "left_knee_joint")])
def test_exchanged_columns_of_moving_joints_are_found_and_named(pair: tuple[str, str], fault: str) -> None:
    found = fatal(exchanged(clip_rollout("walk_slow", fault), *pair))
    named = {finding.column for finding in found if finding.rule == "joint-order"}
    assert named == {f"joint_pos[{name}]" for name in pair}


def test_left_for_right_throughout_is_found() -> None:
    rollout = clip_rollout("walk_slow")
    swap = {"left": "right", "right": "left"}
    names = [name.split("_", 1) for name in rollout.joints]
    order = [rollout.joints.index(f"{swap.get(side, side)}_{rest}") for side, rest in names]
    assert any(finding.rule == "joint-order" for finding in fatal(columns(rollout, order)))


def test_too_short_a_file_is_not_set_aside_for_its_order() -> None:
    rollout = exchanged(clip_rollout("walk_slow"), "left_knee_joint", "right_knee_joint")
    short = {column: getattr(rollout, column)[:90] for column in rollout.columns}
    assert "joint-order" not in {finding.rule for finding in fatal(replace(rollout, time=rollout.time[:90], **short))}


@pytest.mark.parametrize("name", ["left_shoulder_pitch_joint", "left_elbow_joint", "right_knee_joint"])
def test_a_reversed_joint_is_found_in_a_squat(name: str) -> None:
    rollout = clip_rollout("squat_shallow")
    sign = np.where(np.array(rollout.joints) == name, -1.0, 1.0)
    turned = replace(rollout, joint_pos=rollout.joint_pos * sign, joint_vel=rollout.joint_vel * sign)
    assert ("response-sign", f"joint_target[{name}]") in {(finding.rule, finding.column) for finding in fatal(turned)}


def test_a_tilted_imu_on_a_base_that_heads_along_x_is_no_other_frame() -> None:
    """Both frames' readings are nearly one there, and the tilt decides between them."""
    rollout, rng = g1_rollout(0, 0.1), np.random.default_rng(0)
    speed = np.zeros((rollout.frames, 3))
    speed[:, 0] = 1 + 0.5 * np.sin(3 * rollout.time)
    place = np.cumsum(speed, axis=0) * 0.02
    tilt = np.tile([np.cos(0.06), 0.0, np.sin(0.06), 0.0], (rollout.frames, 1))
    base = {"base_quat": tilt, "base_ang_vel": 0 * speed, "base_lin_vel": speed, "base_pos": place}
    sliding = replace(rollout, **{name: value + rng.normal(0, 0.002, value.shape) for name, value in base.items()})
    assert fatal_with(sliding) == set()
    assert fatal_with(sliding, frame_apart=0.0) == {"velocity-frame"}
