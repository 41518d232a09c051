"""Overlaps of the robot's links agree with MuJoCo's contacts and with brute force."""

import mujoco
import numpy as np
import pytest

from bumblebee.motion.filters.self_collision import compared_bodies, segment_distance, self_penetration
from bumblebee.robot.facts import joints, stand_pose
from bumblebee.robot.model import RobotConfig, build_model


def test_the_distance_of_segments_is_the_smallest_over_a_fine_grid():
    rng = np.random.default_rng(1)
    ends = rng.normal(size=(4, 60, 3))
    ends[1, :10] = ends[0, :10]  # points
    ends[3, 10:20] = ends[2, 10:20] + (ends[1, 10:20] - ends[0, 10:20])  # parallel ones
    share = np.linspace(0, 1, 201)[:, None, None]
    first, second = (ends[i] + share * (ends[i + 1] - ends[i]) for i in (0, 2))
    grid = np.linalg.norm(first[:, None] - second[None], axis=-1).min(axis=(0, 1))
    assert segment_distance(*ends) == pytest.approx(grid, abs=0.02)
    assert np.all(segment_distance(*ends) <= grid + 1e-9)


def deepest_by_mujoco(model: mujoco.MjModel, qpos: np.ndarray) -> float:
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    depth = 0.0
    for contact in data.contact[: data.ncon]:
        bodies = [model.body(model.geom_bodyid[geom]).name for geom in (contact.geom1, contact.geom2)]
        if tuple(bodies) in compared_bodies() or tuple(bodies[::-1]) in compared_bodies():
            depth = max(depth, -contact.dist)
    return depth


def test_depths_are_those_of_mujocos_contacts():
    model = build_model(RobotConfig(feet="capsules", self_collision=True))
    rng = np.random.default_rng(2)
    ranges = np.array([joint.range for joint in joints()])
    joint_pos = rng.uniform(0.6 * ranges[:, 0], 0.6 * ranges[:, 1], (40, 23))
    root_pos, root_quat = np.tile([0.3, -1.0, 3.0], (40, 1)), np.tile([0.8, 0.0, 0.6, 0.0], (40, 1))
    depth, bodies = self_penetration(root_pos, root_quat, joint_pos)
    wanted = [deepest_by_mujoco(model, np.r_[p, q, j]) for p, q, j in zip(root_pos, root_quat, joint_pos, strict=True)]
    assert depth == pytest.approx(wanted, abs=1e-4)
    assert 5 < np.count_nonzero(depth) < 40  # the draw has both
    assert [pair == ("", "") for pair in bodies] == (depth == 0).tolist()


def test_a_relaxed_stand_touches_nothing():
    depth, _ = self_penetration(np.zeros((1, 3)), np.array([[1.0, 0, 0, 0]]), stand_pose()[None])
    assert depth.tolist() == [0.0]
