"""Links kept apart: closest points against brute force, and arms that are told to go through the body."""

import mujoco
import numpy as np
import pytest

from bumblebee.motion.retarget.banded import Normal
from bumblebee.motion.retarget.collision import (
    _between,
    _closest,
    _hops,
    depths,
    keep_apart,
    obstacles,
    shape_heights,
)
from bumblebee.motion.retarget.config import RetargetConfig
from bumblebee.motion.retarget.mapping import this_robot
from bumblebee.motion.retarget.retarget import aim, fit
from bumblebee.motion.retarget.tree import poses
from tests.motion.retarget.robots import small
from tests.motion.retarget.stepping import FPS, standing


def test_closest_points_of_capsules_are_those_of_brute_force():
    rng = np.random.default_rng(0)
    ends = rng.normal(size=(40, 2, 2, 3))
    ends[0, 0, 1] = ends[0, 0, 0]  # a sphere and a capsule
    ends[1, :, 1] = ends[1, :, 0]  # two spheres
    ends[2, 1] = ends[2, 0] + [0, 0, 0.5]  # parallel
    ends[3, 1] = ends[3, 0] + 3 * (ends[3, 0, 1] - ends[3, 0, 0])  # one behind the other on a line
    distance, first, second = _closest(ends[:, 0], ends[:, 1])
    share = np.linspace(0, 1, 401)[:, None]
    for t in range(len(ends)):
        a = (1 - share) * ends[t, 0, 0] + share * ends[t, 0, 1]
        b = (1 - share) * ends[t, 1, 0] + share * ends[t, 1, 1]
        truth = np.linalg.norm(a[:, None] - b, axis=-1).min()
        assert distance[t] == pytest.approx(truth, abs=2e-4 + 1e-2 * (truth < 0.05))
        assert np.linalg.norm(first[t] - second[t]) == pytest.approx(distance[t])


def test_distances_of_the_small_robots_links_are_those_of_mujoco():
    robot = small()
    kept = obstacles(robot)
    rng = np.random.default_rng(1)
    joint = rng.uniform(np.maximum(robot.tree.low, -2), np.minimum(robot.tree.high, 2), (20, len(robot.tree.joints)))
    at = poses(robot.tree, np.zeros((20, 3)), np.tile(np.eye(3), (20, 1, 1)), joint)
    data = mujoco.MjData(robot.model)
    wanted = [g for g in range(robot.model.ngeom) if robot.model.geom_bodyid[g] - 1 not in robot.sole_body]
    found = _between(
        at.pos[:, kept.shapes.body, None] + np.einsum("tgij,gej->tgei", at.rot[:, kept.shapes.body], kept.shapes.ends),
        kept.shapes,
        kept.pairs,
    )
    feet = kept.shapes.foot[kept.pairs].any(axis=1)
    for t in range(20):
        data.qpos[:] = np.r_[0, 0, 0, 1, 0, 0, 0, joint[t]]
        mujoco.mj_kinematics(robot.model, data)
        for number in np.flatnonzero(~feet):
            a, b = (wanted[shape] for shape in kept.pairs[number])
            there = mujoco.mj_geomDistance(robot.model, data, a, b, 5.0, None)
            assert found[t, number] == pytest.approx(there, abs=1e-5) or (there < 0 and found[t, number] < 0)


def test_neighbours_and_what_overlaps_at_rest_are_no_obstacles():
    robot = this_robot()
    kept = obstacles(robot)
    hops = _hops(robot.tree.parent)
    assert (hops[tuple(kept.shapes.body[kept.pairs].T)] > 2).all()
    at = poses(robot.tree, np.zeros((1, 3)), np.eye(3)[None], robot.rest[None])
    assert depths(at, kept)[0] == 0 and len(kept.pairs) > 50
    names = np.array(robot.tree.bodies)[kept.shapes.body[kept.pairs]]
    assert any("wrist" in "".join(pair) and "torso" in "".join(pair) for pair in names)


def test_hops_count_the_joints_between_bodies():
    assert _hops(np.array([-1, 0, 1, 0])).tolist() == [[0, 1, 2, 1], [1, 0, 1, 2], [2, 1, 0, 3], [1, 2, 3, 0]]


def test_the_terms_slope_is_the_derivative_of_its_cost():
    robot = small()
    kept = obstacles(robot)
    rng = np.random.default_rng(4)
    size = 6 + len(robot.tree.joints)
    joint = rng.uniform(np.maximum(robot.tree.low, -1.5), np.minimum(robot.tree.high, 1.5), (12, size - 6))
    root = np.tile([0.0, 0.0, 0.35], (12, 1))

    def term(q: np.ndarray) -> Normal:
        normal = Normal(12, size)
        at = poses(robot.tree, root, np.tile(np.eye(3), (12, 1, 1)), q)
        keep_apart(normal, at, robot, kept, 0.03, 0.01)
        return normal

    assert term(joint).cost > 0
    step = 1e-6 * rng.normal(size=joint.shape)
    change = (term(joint + step).cost - term(joint - step).cost) / 2
    assert change == pytest.approx(2 * float((term(joint).slope[:, 6:] * step).sum()), rel=1e-4)


def _reaching(frames: int = 80) -> np.ndarray:
    """The left forearm turns from ahead to the right and through the belly, the right one hangs: wrists (T, 2, 3)."""
    angle = np.linspace(0, 2.6, frames)
    ahead = 0.24 * np.stack([np.cos(angle), -np.sin(angle), 0 * angle], axis=1)
    return np.stack([ahead, np.broadcast_to([0.0, -0.1, -0.22], ahead.shape)], axis=1)


def test_arms_that_are_told_to_go_through_the_torso_stay_out_of_it():
    robot, config = this_robot(), RetargetConfig()
    kept = obstacles(robot)
    target = aim(standing(80, wrists=_reaching()), robot, FPS, config)

    def deepest(config: RetargetConfig) -> float:
        at = fit(target, robot, config)
        return float(depths(poses(robot.tree, at.root, at.turn, at.joint), kept).max())

    assert deepest(RetargetConfig(collision=10.0)) > 0.03  # the test would be idle otherwise
    assert deepest(config) < config.margin


def test_knees_and_hands_stay_above_the_floor():
    robot = this_robot()
    motion = standing(60)
    motion.positions[..., 2] -= 0.7 * np.sin(np.linspace(0, np.pi, 60))[:, None]

    feet = [3, 4, 7, 8]
    motion.positions[:, feet] = standing(60).positions[:, feet]
    at = fit(aim(motion, robot, FPS, RetargetConfig()), robot, RetargetConfig())
    low = shape_heights(poses(robot.tree, at.root, at.turn, at.joint), obstacles(robot))
    assert low.min() > -0.005
