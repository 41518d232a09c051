"""Robots other than the G1: one without a waist and with one ankle joint, and the H1 from published figures."""

import numpy as np
import pytest

from benchmarks.retarget.any_robot import measured, measures
from bumblebee.motion.retarget.config import RetargetConfig
from bumblebee.motion.retarget.mapping import Robot, read_robot
from bumblebee.motion.retarget.retarget import aim, fit
from tests.motion.retarget.robots import H1, small
from tests.motion.retarget.stepping import FPS, jump, steps


@pytest.fixture(params=["small", "h1"])
def robot(request) -> Robot:
    return small() if request.param == "small" else read_robot(H1 / "h1.xml", H1 / "h1.yaml")


def test_any_humanoid_steps_on_the_floor_within_its_limits(robot):
    found = measured(robot, steps()[0])
    assert found["penetration_mm"] < 5 and found["floating_mm"] < 5 and found["skate_mm_s"] < 20
    assert found["limit_frames"] == 0 and found["velocity_share"] == 0 and found["self_penetration_mm"] < 5


def test_any_humanoid_jumps_as_high_as_its_legs_are_long(robot):
    motion, up = jump()
    at = fit(aim(motion, robot, FPS, RetargetConfig()), robot, RetargetConfig())
    legs = sum(np.linalg.norm(aim(motion, robot, FPS, RetargetConfig()).segments[0, i]) for i in range(2))
    assert np.ptp(at.root[:, 2]) == pytest.approx(up.max() * legs / 0.84, rel=0.25)


def test_the_measures_see_what_is_wrong(robot):
    motion = steps()[0]
    at = fit(aim(motion, robot, FPS, RetargetConfig()), robot, RetargetConfig())
    good = measures(robot, at, FPS, motion.positions)
    time = np.arange(len(at.root))[:, None]
    sunk = type(at)(at.root - [0, 0, 0.02], at.turn, at.joint)
    slid = type(at)(at.root + time / FPS * [0.2, 0, 0], at.turn, at.joint)
    bent = type(at)(at.root, at.turn, at.joint + 4 * (time % 2))
    assert measures(robot, sunk, FPS, motion.positions)["penetration_mm"] == pytest.approx(
        good["penetration_mm"] + 20, abs=2
    )
    assert measures(robot, slid, FPS, motion.positions)["skate_mm_s"] == pytest.approx(200, abs=30)
    worse = measures(robot, bent, FPS, motion.positions)
    assert worse["limit_frames"] > 0.4 and worse["velocity_share"] > 0.4
    assert worse["jerk_rad_s3"] > 100 * good["jerk_rad_s3"]
