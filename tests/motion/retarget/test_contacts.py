"""Who stands when, on made-up steps and jumps whose stance is known."""

import numpy as np
import pytest

from bumblebee.motion.grounding import GroundingConfig
from bumblebee.motion.retarget.config import ContactConfig
from bumblebee.motion.retarget.contacts import stance
from tests.motion.retarget.stepping import ANKLE, FPS, jump, standing, steps


def _of(motion):
    return stance(motion.positions, motion.fps, ContactConfig(), GroundingConfig())


@pytest.mark.parametrize("fps", [30.0, FPS, 120.0])
def test_feet_stand_when_they_stand_and_not_in_the_air(fps):
    motion, known = steps(4, fps)
    found = _of(motion).contact.max(axis=2)
    for side in range(2):
        edge = np.flatnonzero(np.diff(known[:, side]))
        clear = np.abs(np.arange(len(known))[:, None] - edge).min(axis=1) > 0.1 * fps  # away from touch and lift
        assert found[clear & known[:, side], side].min() > 0.9
        assert found[clear & ~known[:, side], side].max() < 0.1


def test_rest_is_the_height_of_ankle_and_toe_and_the_floor_is_zero():
    found = _of(steps()[0])
    np.testing.assert_allclose(found.rest, [[ANKLE, ANKLE - 0.06]] * 2, atol=1e-6)
    np.testing.assert_allclose(found.floor, 0, atol=0.002)


def test_a_jump_is_no_floor():
    motion, up = jump()
    found = _of(motion)
    assert np.abs(found.floor).max() < 0.005
    assert found.contact[up > 0.2].max() < 0.05
    assert found.contact[:15].min() > 0.95 and found.contact[-15:].min() > 0.95


def test_who_stands_still_stands_with_all_of_both_feet():
    assert _of(standing()).contact.min() == 1.0


def test_a_foot_that_slides_stands_with_its_lowest_part():
    motion = standing()
    motion.positions[:, :, 0] += np.arange(60)[:, None] / FPS  # 1 m/s: nothing is slow
    assert (_of(motion).contact.max(axis=(1, 2)) == 1.0).all()


def test_a_blink_is_noise():
    motion = standing()
    feet = [3, 4]
    motion.positions[30, feet, 2] += 0.1  # one frame of 20 ms
    assert _of(motion).contact[:, 0].min() > 0.9
