"""Inverse kinematics over the whole trajectory: Gauss-Newton on all frames at once.

Frame by frame, a solution depends on where the motion starts, and jumps where two solutions meet. Here every frame
knows its neighbours: feet that stand do not slide, and accelerations are held down by a term of their own.
"""

from dataclasses import dataclass

import numpy as np

from bumblebee import quaternions
from bumblebee.motion.retarget.banded import Normal
from bumblebee.motion.retarget.collision import Obstacles, keep_apart, obstacles
from bumblebee.motion.retarget.config import RetargetConfig
from bumblebee.motion.retarget.mapping import CORNERS, POINTS, Robot
from bumblebee.motion.retarget.targets import SEGMENTS, Targets
from bumblebee.motion.retarget.tree import Poses, jacobian, points, poses

ROOT = 6
_LARGEST = 0.4  # rad or m: of one step
_MARGIN = 0.002  # rad inside a joint's range
_DAMPING = 1.0, 1e7  # least and most of Levenberg's: a segment weighs 1e3
HIPS = [POINTS.index("left_hip"), POINTS.index("right_hip")]


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The robot over T frames: `root` (T, 3) [m], `turn` (T, 3, 3) of the root, `joint` (T, n) [rad]."""

    root: np.ndarray
    turn: np.ndarray
    joint: np.ndarray

    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Root, turn, joint."""
        return self.root, self.turn, self.joint


def start(target: Targets, robot: Robot) -> Trajectory:
    """The robot with its joints at rest, or as they are to be near, its root where the person's hips are."""
    frames = len(target.hips)
    joint = target.near(robot)
    at = poses(robot.tree, np.zeros((frames, 3)), target.frame, joint)
    hips = points(at, robot.body[HIPS], robot.local[HIPS]).mean(axis=1)
    return Trajectory(target.hips - hips, target.frame, joint)


def solve(target: Targets, robot: Robot, config: RetargetConfig, guess: Trajectory | None = None) -> Trajectory:
    """The trajectory that fits the targets."""
    now = guess or start(target, robot)
    kept = obstacles(robot)
    normal = equations(now, target, robot, config, kept)
    damping = _DAMPING[0]
    for _ in range(config.iterations):
        change = normal.solve(np.full(ROOT + len(robot.tree.joints), damping))
        change = np.clip(change, -_LARGEST, _LARGEST)
        tried = moved(now, change)
        after = equations(tried, target, robot, config, kept)
        if after.cost > normal.cost:
            damping *= 10
            if damping > _DAMPING[1]:
                break
            continue
        gained = normal.cost - after.cost
        now, normal, damping = tried, after, max(damping / 10, _DAMPING[0])
        if gained < config.converged * normal.cost:
            break
    return Trajectory(now.root, now.turn, np.clip(now.joint, robot.tree.low, robot.tree.high))


def moved(now: Trajectory, change: np.ndarray) -> Trajectory:
    """The trajectory after a step (T, 6 + n)."""
    turn = quaternions.to_matrices(quaternions.from_rotation_vector(change[:, 3:ROOT])) @ now.turn
    return Trajectory(now.root + change[:, :3], turn, now.joint + change[:, ROOT:])


def equations(now: Trajectory, target: Targets, robot: Robot, config: RetargetConfig, kept: Obstacles) -> Normal:
    """Normal equations of all terms at a trajectory."""
    at = poses(robot.tree, now.root, now.turn, now.joint)
    normal = Normal(len(now.root), ROOT + len(robot.tree.joints))
    _limbs(normal, at, target, robot, config)
    _feet(normal, at, target, robot, config)
    _joints(normal, now, target, robot, config)
    _root(normal, now, target, config)
    keep_apart(normal, at, robot, kept, config.margin, config.collision)
    return normal


def _limbs(normal: Normal, at: Poses, target: Targets, robot: Robot, config: RetargetConfig) -> None:
    """Directions of the segments, and the place of the hips."""
    where = points(at, robot.body, robot.local)
    slope = jacobian(robot.tree, at, robot.body, where)
    mix = _mix()
    frames = len(where)
    residual = np.einsum("rk,tkc->trc", mix, where)
    residual[:, :-1] -= target.segments
    residual[:, -1] -= target.hips
    rows = (mix @ slope.reshape(frames, len(POINTS), -1)).reshape(frames, -1, slope.shape[-1])
    sigma = np.array([config.segment] * (len(mix) - 1) + [config.root])
    weight = np.broadcast_to(np.repeat(sigma**-2.0, 3), rows.shape[:2])
    normal.add(rows, residual.reshape(frames, -1), weight)


def _mix() -> np.ndarray:
    """Which points make a segment, the torso and the middle of the hips: (S + 2, K)."""
    mix = np.zeros((len(SEGMENTS) + 2, len(POINTS)))
    for row, (a, b) in enumerate(SEGMENTS):
        mix[row, [POINTS.index(a), POINTS.index(b)]] = -1.0, 1.0
    mix[-2, POINTS.index("neck")] = 1.0
    mix[-2, HIPS] = -0.5
    mix[-1, HIPS] = 0.5
    return mix


def _feet(normal: Normal, at: Poses, target: Targets, robot: Robot, config: RetargetConfig) -> None:
    """Directions of the feet, soles that stand where they stand, none below the floor."""
    where = points(at, robot.sole_body, robot.sole)
    slope = jacobian(robot.tree, at, robot.sole_body, where)
    frames = len(where)
    for side in range(2):
        heel, toe = side * CORNERS, side * CORNERS + 2
        along = (where[:, toe : toe + 2] - where[:, heel : heel + 2]).mean(axis=1) - target.feet[:, side]
        rows = (slope[:, toe : toe + 2] - slope[:, heel : heel + 2]).mean(axis=1)
        normal.add(rows, along, np.full((frames, 3), config.foot**-2.0))
    height = where[..., 2] - robot.radius
    weight = np.where(height < 0, config.clearance**-2.0, target.contact * config.sole**-2.0)
    normal.add(slope[:, :, 2], height, weight)
    held = np.minimum(target.contact[1:], target.contact[:-1])
    weight = np.repeat(held, 2, axis=1) * (config.slip / target.fps) ** -2.0
    rows = slope[:, :, :2].reshape(frames, -1, slope.shape[-1])
    normal.add_change(rows, np.diff(where[..., :2], axis=0).reshape(frames - 1, -1), weight)


def _joints(normal: Normal, now: Trajectory, target: Targets, robot: Robot, config: RetargetConfig) -> None:
    """Accelerations, angles at rest, ranges and speeds of the joints."""
    size = len(robot.tree.joints)
    away = now.joint - target.near(robot)
    wide = np.zeros((len(now.joint), ROOT + size))
    wide[:, ROOT:] = away  # the acceleration of a given posture is the motion's own
    weight = np.r_[np.zeros(ROOT), np.full(size, (config.acceleration / target.fps**2) ** -2.0)]
    normal.add_differences(2, wide[2:] - 2 * wide[1:-1] + wide[:-2], weight)
    each = np.arange(ROOT, ROOT + size)
    normal.blocks[0][:, each, each] += config.posture**-2.0
    normal.slope[:, ROOT:] += config.posture**-2.0 * away
    normal.cost += config.posture**-2.0 * float(np.square(away).sum())
    beyond = now.joint - np.clip(now.joint, robot.tree.low + _MARGIN, robot.tree.high - _MARGIN)
    normal.blocks[0][:, each, each] += (beyond != 0) * config.limit**-2.0
    normal.slope[:, ROOT:] += config.limit**-2.0 * beyond
    normal.cost += config.limit**-2.0 * float(np.square(beyond).sum())
    wide[:, ROOT:] = now.joint
    step = np.diff(wide, axis=0)
    most = np.r_[np.full(ROOT, np.inf), 0.95 * robot.fastest / target.fps]
    over = step - np.clip(step, -most, most)
    normal.add_differences(1, over, (over != 0) * (config.speed / target.fps) ** -2.0)


def _root(normal: Normal, now: Trajectory, target: Targets, config: RetargetConfig) -> None:
    """Acceleration of the root against the person's, and changes of its angular velocity."""
    size = normal.slope.shape[1]
    frames = len(now.root)
    wanted = target.hips
    residual = np.zeros((frames - 2, size))
    residual[:, :3] = np.diff(now.root - wanted, 2, axis=0)
    turned = np.swapaxes(now.turn[:-1], 1, 2) @ now.turn[1:]
    rate = (
        np.stack(
            [turned[:, 2, 1] - turned[:, 1, 2], turned[:, 0, 2] - turned[:, 2, 0], turned[:, 1, 0] - turned[:, 0, 1]],
            -1,
        )
        / 2
    )
    rate = np.einsum("tij,tj->ti", now.turn[:-1], rate)
    residual[:, 3:ROOT] = np.diff(rate, axis=0)
    sigma = config.root_acceleration / target.fps**2
    weight = np.r_[np.full(3, sigma**-2.0), np.full(3, (10 * sigma) ** -2.0), np.zeros(size - ROOT)]
    normal.add_differences(2, residual, weight)
