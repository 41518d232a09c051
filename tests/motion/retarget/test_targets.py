"""Targets of the robot, from people who are turned, shifted, scaled, mirrored, faster or slower."""

import numpy as np
import pytest

from bumblebee.motion.human.motion import HumanMotion
from bumblebee.motion.retarget.config import RetargetConfig
from bumblebee.motion.retarget.mapping import this_robot
from bumblebee.motion.retarget.retarget import aim
from bumblebee.motion.retarget.targets import SEGMENTS, Targets, at_rate
from tests.motion.retarget.stepping import ANKLE, FPS, HIPS, changed, jump, standing, steps, turned


def _aim(motion: HumanMotion) -> Targets:
    return aim(motion, this_robot(), FPS, RetargetConfig())


def test_a_person_of_any_size_gives_the_same_targets():
    adult = _aim(steps()[0])
    for size in (0.5, 1.4):
        other = _aim(changed(steps()[0], lambda p, size=size: size * p))
        for name in ("segments", "hips", "feet", "contact", "frame"):
            np.testing.assert_allclose(getattr(other, name), getattr(adult, name), atol=1e-6)


def test_a_person_elsewhere_is_elsewhere_and_no_floor_is_left_over():
    here, there = _aim(steps()[0]), _aim(changed(steps()[0], lambda p: p + np.array([3.0, -2.0, 0.7])))
    shift = there.hips - here.hips
    np.testing.assert_allclose(shift[:, 2], 0, atol=1e-6)
    np.testing.assert_allclose(shift, np.broadcast_to(shift[0], shift.shape), atol=1e-9)
    np.testing.assert_allclose(there.segments, here.segments, atol=1e-9)


def test_who_turns_turns_the_targets():
    here, there = _aim(steps()[0]), _aim(turned(steps()[0], 1.0))
    c, s = np.cos(1.0), np.sin(1.0)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    np.testing.assert_allclose(there.segments, here.segments @ turn.T, atol=1e-9)
    np.testing.assert_allclose(there.frame, turn @ here.frame, atol=1e-9)


def test_segments_have_the_robots_lengths_and_the_persons_directions():
    target, motion = _aim(standing()), standing()
    for row, (a, b) in enumerate(SEGMENTS):
        said = motion.landmark(b)[30] - motion.landmark(a)[30]
        found = target.segments[30, row]
        np.testing.assert_allclose(found / np.linalg.norm(found), said / np.linalg.norm(said), atol=1e-6)
    thigh = SEGMENTS.index(("left_hip", "left_knee"))
    assert np.linalg.norm(target.segments[0, thigh]) == pytest.approx(0.3, abs=0.08)  # a G1's, not a person's 0.42


def test_hips_stand_as_high_as_the_bent_legs_say():
    target = _aim(standing())
    leg = np.linalg.norm(target.segments[0, 0]) + np.linalg.norm(target.segments[0, 1])
    bent = (HIPS - ANKLE) / 0.84  # of the person's straight leg
    assert target.hips[30, 2] - 0.035 == pytest.approx(leg * bent, abs=0.02)  # the ankle is 35 mm over the sole


def test_a_jump_rises_by_the_scale_of_the_legs():
    motion, up = jump()
    target = _aim(motion)
    rise = np.ptp(target.hips[:, 2])
    assert 0.6 * up.max() < rise < 0.8 * up.max()
    assert np.abs(target.floor).max() < 0.005


def test_the_frame_is_upright_ahead_and_right_handed():
    frame = _aim(standing()).frame
    np.testing.assert_allclose(frame, np.broadcast_to(np.eye(3), frame.shape), atol=1e-6)
    np.testing.assert_allclose(np.linalg.det(_aim(steps()[0]).frame), 1)


def test_the_same_person_at_another_rate_is_where_it_was():
    slow, fast = at_rate(steps(fps=FPS)[0], FPS, 8.0), at_rate(steps(fps=2 * FPS)[0], FPS, 8.0)
    assert abs(len(slow) - len(fast)) <= 1
    frames = min(len(slow), len(fast))
    assert np.abs(slow[:frames] - fast[:frames]).max() < 0.03


def test_noise_above_the_cutoff_goes_and_slow_movement_stays():
    motion = standing(200, 120.0)
    time = np.arange(200) / 120
    slow, noise = 0.1 * np.sin(2 * np.pi * time), 0.02 * np.sin(2 * np.pi * 40 * time)
    motion.positions[:, :, 0] += (slow + noise)[:, None]
    found = at_rate(motion, 120.0, 8.0)[20:-20] - standing(200, 120.0).positions[20:-20]
    assert np.abs(found[:, 0, 0] - slow[20:-20]).max() < 0.005


@pytest.mark.parametrize("frames", range(2, 8))
def test_few_frames_are_resampled_without_a_filters_ringing(frames):
    found = at_rate(standing(frames, 30.0), FPS, 8.0)
    assert len(found) == int((frames - 1) / 30 * FPS + 1e-6) + 1
    np.testing.assert_allclose(found, np.broadcast_to(standing(2).positions[:1], found.shape), atol=1e-9)
