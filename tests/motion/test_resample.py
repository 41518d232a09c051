"""Resampling keeps the motion: exact on the old samples, blind to signs, the same whether done once or twice."""

import numpy as np
import pytest

from bumblebee.motion.resample import resample
from bumblebee.quaternions import normalised

FIELDS = ("root_pos", "root_quat", "joint_pos")


@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0, 119.88])
def test_length_and_ends(motions, fps):
    raw = motions.raw(frames=73, fps=fps)
    came = resample(raw, 50.0)
    seconds = (73 - 1) / fps
    assert seconds - 1 / 50 < (len(came.root_pos) - 1) / 50 <= seconds + 1e-9
    for field in FIELDS:
        np.testing.assert_allclose(getattr(came, field)[0], getattr(raw, field)[0], atol=1e-12)


def test_samples_that_coincide_keep_their_values(motions):
    raw = motions.raw(frames=61, fps=30.0)
    came = resample(raw, 50.0)
    for field in FIELDS:
        np.testing.assert_allclose(getattr(came, field)[::5], getattr(raw, field)[::3], atol=1e-9)


def test_a_resampled_motion_stays_as_it_is(motions):
    once = resample(motions.raw(frames=61), 50.0)
    twice = resample(once, 50.0)
    for field in FIELDS:
        np.testing.assert_allclose(getattr(twice, field), getattr(once, field), atol=1e-15)


def test_up_and_down_again_gives_the_motion_back(motions):
    raw = motions.raw(frames=61, fps=30.0)
    came = resample(resample(raw, 90.0), 30.0)
    for field in FIELDS:
        np.testing.assert_allclose(getattr(came, field), getattr(raw, field), atol=1e-6)


def test_a_smooth_motion_is_met_between_its_samples(motions):
    came, true = resample(motions.raw(frames=61, fps=30.0), 50.0), motions.raw(frames=101, fps=50.0)
    np.testing.assert_allclose(came.joint_pos, true.joint_pos, atol=1e-4)
    np.testing.assert_allclose(came.root_quat, true.root_quat, atol=1e-4)


def test_quaternions_stay_on_the_sphere_and_do_not_care_for_signs(motions):
    raw = motions.raw(frames=61)
    flips = np.random.default_rng(0).choice([-1.0, 1.0], size=(61, 1))
    scaled = motions.raw(frames=61, root_quat=raw.root_quat * flips * 1.01)
    np.testing.assert_allclose(resample(scaled, 50).root_quat, resample(raw, 50).root_quat, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(normalised(resample(scaled, 50).root_quat), axis=1), 1, atol=1e-12)
