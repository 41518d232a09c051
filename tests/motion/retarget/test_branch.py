"""A fit stays on the branch on which the robot's hips are as high as the person's, and says so where none does."""

from dataclasses import replace

import numpy as np

from bumblebee.motion.retarget.branch import far_note, solve_near
from bumblebee.motion.retarget.config import RetargetConfig
from bumblebee.motion.retarget.mapping import this_robot
from bumblebee.motion.retarget.retarget import aim
from bumblebee.motion.retarget.solve import HIPS, Trajectory, solve
from bumblebee.motion.retarget.targets import Targets
from bumblebee.motion.retarget.tree import points, poses
from tests.motion.retarget.stepping import steps, turning_kick

CONFIG = RetargetConfig()


def rise(at: Trajectory, target: Targets) -> np.ndarray:
    """How much higher the robot's hips are than the target's (T,) [m]."""
    robot = this_robot()
    where = points(poses(robot.tree, at.root, at.turn, at.joint), robot.body[HIPS], robot.local[HIPS])
    return where.mean(axis=1)[:, 2] - target.hips[:, 2]


def test_a_fast_turning_kick_keeps_the_hips_up_and_the_knees_off_their_limits():
    target = aim(turning_kick(), this_robot(), 50.0, CONFIG)
    first, found = solve(target, this_robot(), CONFIG), solve_near(target, this_robot(), CONFIG)
    assert rise(first, target).min() < -0.4  # the trap is there
    assert np.abs(rise(found, target)).max() < 0.1
    knees = [this_robot().tree.joints.index(f"{side}_knee_joint") for side in ("left", "right")]
    assert found.joint[:, knees].max() < this_robot().tree.high[knees].min() - 0.5
    assert far_note(found, target, this_robot(), CONFIG) == ()


def test_a_fit_that_was_right_is_returned_to_the_digit():
    target = aim(steps()[0], this_robot(), 50.0, CONFIG)
    for one, other in zip(
        solve_near(target, this_robot(), CONFIG).arrays(), solve(target, this_robot(), CONFIG).arrays(), strict=True
    ):
        np.testing.assert_array_equal(one, other)


def test_hips_that_no_fit_keeps_up_are_noted_with_place_and_time():
    target = aim(steps()[0], this_robot(), 50.0, CONFIG)
    at = solve(target, this_robot(), CONFIG)
    bump = 0.3 * np.exp(-(((np.arange(len(at.root)) - 30) / 4) ** 2))
    low = Trajectory(at.root - bump[:, None] * [0.0, 0.0, 1.0], at.turn, at.joint)
    (note,) = far_note(low, target, this_robot(), CONFIG)
    assert "m below the person's, scaled, at 0.6" in note
    assert far_note(low, target, this_robot(), replace(CONFIG, root=0.2)) == ()
