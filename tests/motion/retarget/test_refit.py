"""A robot's motion that floats is put on the floor, near its own angles; one that stands stays as it came."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.motion.grounding import GroundingConfig
from bumblebee.motion.kinematics import lowest, sole_points
from bumblebee.motion.resample import resample
from bumblebee.motion.retarget.config import RetargetConfig
from bumblebee.motion.retarget.refit import refit


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
    """The test motion walks on at 0.2 m/s without lifting a foot: its soles slide by as much."""
    floating = replace(swaying, root_pos=swaying.root_pos + np.array([0.0, 0.0, 0.08]))
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
