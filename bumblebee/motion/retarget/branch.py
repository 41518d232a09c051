"""The right one of several local minima: a fit in which the root leaves the person's hips is made again from another.

A foot that stands may hold the root where the person has long turned on: the leg twists to its limits, and the robot is
pulled down to the floor. From a trajectory whose root was held near the person's hips the same terms fit well.
"""

from dataclasses import replace

import numpy as np

from bumblebee.motion.retarget.config import RetargetConfig
from bumblebee.motion.retarget.mapping import Robot
from bumblebee.motion.retarget.solve import HIPS, Trajectory, solve
from bumblebee.motion.retarget.targets import Targets
from bumblebee.motion.retarget.tree import points, poses

_FAR = 3.0  # standard deviations `root` by which the robot's hips may be higher or lower than the person's
_HELD = 0.1  # of that standard deviation where the root is held


def solve_near(target: Targets, robot: Robot, config: RetargetConfig) -> Trajectory:
    """The trajectory that fits the targets, its hips as high as the person's as far as any of the fits keeps them.

    A first fit that keeps them is returned as it is; else one that starts from a fit with the root held, else that one.
    """
    first = solve(target, robot, config)
    if _near(first, target, robot, config):
        return first
    held = solve(target, robot, replace(config, root=_HELD * config.root))
    freed = solve(target, robot, config, held)
    return freed if _near(freed, target, robot, config) else held


def far_note(at: Trajectory, target: Targets, robot: Robot, config: RetargetConfig) -> tuple[str, ...]:
    """A note where the robot's hips stay higher or lower than the person's: what it does there is another motion."""
    if _near(at, target, robot, config):
        return ()
    off = _rise(at, target, robot)
    frame = int(np.abs(off).argmax())
    where = f"{abs(off[frame]):.2f} m {'above' if off[frame] > 0 else 'below'} the person's, scaled"
    return (f"the robot's hips are {where}, at {frame / target.fps:.2f} s",)


def _near(at: Trajectory, target: Targets, robot: Robot, config: RetargetConfig) -> bool:
    return bool(np.abs(_rise(at, target, robot)).max() <= _FAR * config.root)


def _rise(at: Trajectory, target: Targets, robot: Robot) -> np.ndarray:
    """How much higher the robot's hips are than the person's, scaled, (T,) [m]."""
    where = points(poses(robot.tree, at.root, at.turn, at.joint), robot.body[HIPS], robot.local[HIPS])
    return where.mean(axis=1)[:, 2] - target.hips[:, 2]
