"""A robot's motion that floats is put on the floor, near its own angles; one that stands stays as it came."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.motion.grounding import GroundingConfig
from bumblebee.motion.kinematics import lowest, sole_points
from bumblebee.motion.resample import resample
from bumblebee.motion.retarget.config import RetargetConfig
from bumblebee.motion.retarget.refit import refit
from bumblebee.robot.facts import joint_names, joints, stand_pose

SETTINGS = GroundingConfig(), RetargetConfig()


def low(raw):
    return lowest(raw.root_pos, raw.root_quat, raw.joint_pos)


@pytest.fixture
def swaying(motions):
    """The test motion at 50 Hz, sampled evenly, which stands on the floor."""
    return resample(motions.raw(frames=80), 50.0)


def test_a_motion_that_stands_is_the_same_object(swaying):
    assert refit(swaying, GroundingConfig(), RetargetConfig()) is swaying


def test_a_motion_that_floats_ever_higher_stands_after(swaying):
    drift = np.linspace(0.03, 0.12, len(swaying.root_pos))
    floating = replace(swaying, root_pos=swaying.root_pos + drift[:, None] * np.array([0.0, 0.0, 1.0]))
    after = refit(floating, GroundingConfig(), RetargetConfig())
    assert low(floating).min() > 0.02
    assert low(after).min() > -0.003 and low(after).max() < 0.006
    assert np.abs(after.joint_pos - swaying.joint_pos).mean() < 0.03
    (note,) = after.notes
    assert note.startswith("the floor was taken out by up to 0.10 m; joint angles changed by 0.0")


def test_feet_that_slide_while_they_float_stand_still_after(swaying):
    """The robot moves on at 0.2 m/s without lifting a foot: its soles slide by as much."""
    moved = 0.2 * np.arange(len(swaying.root_pos)) / swaying.fps
    floating = replace(swaying, root_pos=swaying.root_pos + np.stack([moved, 0 * moved, 0 * moved + 0.08], axis=1))
    after = refit(floating, GroundingConfig(), RetargetConfig())

    def sliding(raw):
        soles = sole_points(raw.root_pos, raw.root_quat, raw.joint_pos)
        return np.linalg.norm(np.diff(soles[..., :2], axis=0), axis=-1).mean() * raw.fps

    assert sliding(floating) > 0.15 and sliding(after) < 0.5 * sliding(floating)


def test_a_few_frames_are_left_as_they_are(swaying):
    few = replace(
        swaying, root_pos=swaying.root_pos[:4] + 0.1, root_quat=swaying.root_quat[:4], joint_pos=swaying.joint_pos[:4]
    )
    assert refit(few, GroundingConfig(), RetargetConfig()) is few


@pytest.fixture
def bowing(motions):
    """The G1 bowing on both feet for 2 s at 50 Hz, 0.1 m over the floor."""
    frames = 100
    joint_pos = np.tile(stand_pose(), (frames, 1))
    joint_pos[:, joint_names().index("waist_pitch_joint")] += 0.2 * np.sin(np.arange(frames) / 17)
    pos, quat = np.tile([0.0, 0.0, 0.8], (frames, 1)), np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1))
    pos[:, 2] += 0.1 - lowest(pos, quat, joint_pos)
    return motions.raw(frames, 50.0, root_pos=pos, root_quat=quat, joint_pos=joint_pos)


def test_a_jump_keeps_its_flight(bowing):
    time = np.arange(100) / 50 - 1
    jump = np.where(np.abs(time) < 0.25, 0.3 * (1 - (time / 0.25) ** 2), 0)
    after = low(refit(replace(bowing, root_pos=bowing.root_pos + np.outer(jump, [0, 0, 1])), *SETTINGS))
    assert after.max() > 0.75 * 0.3  # blended contacts at take-off and landing take the rest
    assert np.abs(after[np.abs(time) > 0.5]).max() < 0.01


def test_who_lies_with_the_feet_up_is_not_pulled_onto_them(bowing):
    on_back = np.tile([np.cos(np.pi / 4), 0.0, -np.sin(np.pi / 4), 0.0], (100, 1))
    hips = [joint_names().index(f"{side}_hip_pitch_joint") for side in ("left", "right")]
    bowing.joint_pos[:, hips] -= 1.2
    bowing.root_pos[:, 2] += 0.1 - lowest(bowing.root_pos, on_back, bowing.joint_pos)
    after = refit(replace(bowing, root_quat=on_back), *SETTINGS)
    assert np.abs(after.joint_pos[:, hips] - bowing.joint_pos[:, hips]).max() < 0.1
    assert np.abs(low(after)).max() < 0.03


def test_ranges_and_motor_speeds_are_kept(bowing):
    elbow = joint_names().index("right_elbow_joint")
    least, most = joints()[elbow].range
    bowing.joint_pos[:, elbow] = np.where(np.arange(100) < 50, least - 0.1, 0.8)
    angle = refit(bowing, *SETTINGS).joint_pos[:, elbow]
    assert least <= angle.min() and angle.max() <= most
    assert np.abs(np.diff(angle)).max() * 50 < joints()[elbow].velocity_limit
