"""Forward kinematics is MuJoCo's; velocities and contacts are those of the motion."""

import mujoco
import numpy as np
import pytest

from bumblebee.motion.clip import angular_velocity, velocities
from bumblebee.motion.contacts import foot_contacts
from bumblebee.motion.kinematics import forward_bodies, lowest_heights, make_clip, sole_points
from bumblebee.robot.facts import FEET, KEY_BODIES, joints
from bumblebee.robot.model import RobotConfig, build_model


@pytest.fixture(scope="module")
def poses() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    quat = rng.normal(size=(12, 4))
    low, high = np.array([joint.range for joint in joints()]).T
    return rng.normal(size=(12, 3)), quat / np.linalg.norm(quat, axis=1)[:, None], rng.uniform(low, high, (12, 23))


def test_every_body_stands_where_mujoco_puts_it(poses):
    model = build_model()
    data = mujoco.MjData(model)
    bodies = forward_bodies(*poses)
    clip = make_clip("random", 50, *poses)
    assert str(clip) == "<Clip 'random': 0.2 s at 50 Hz, 23 joints>"
    for frame, parts in enumerate(zip(*poses, strict=True)):
        data.qpos[:] = np.concatenate(parts)
        mujoco.mj_kinematics(model, data)
        for name, (pos, quat) in bodies.items():
            np.testing.assert_allclose(pos[frame], data.body(name).xpos, atol=1e-9)
            np.testing.assert_allclose(abs(quat[frame] @ data.body(name).xquat), 1, atol=1e-9)
        keys = [data.body(name).xpos for name in KEY_BODIES]
        np.testing.assert_allclose(clip.key_pos[frame], keys, atol=1e-5)


def test_lowest_heights_are_those_of_the_full_models_geometry(poses):
    model = build_model(RobotConfig(feet="capsules"))
    data = mujoco.MjData(model)
    heights = lowest_heights(*poses)
    for frame, parts in enumerate(zip(*poses, strict=True)):
        data.qpos[:] = np.concatenate(parts)
        mujoco.mj_kinematics(model, data)
        wanted: dict[str, float] = {}
        for geom in range(model.ngeom):
            body = model.body(model.geom_bodyid[geom]).name
            if body != "world":
                axis = abs(data.geom_xmat[geom, 8]) * model.geom_size[geom, 1]
                low = data.geom_xpos[geom, 2] - axis - model.geom_size[geom, 0]
                wanted[body] = min(wanted.get(body, np.inf), low)
        assert heights.keys() == wanted.keys()
        assert max(abs(heights[body][frame] - low) for body, low in wanted.items()) < 1e-5


def test_velocities_are_those_of_a_known_motion():
    time = np.arange(100) / 50
    turn = 0.8 * time
    quat = np.stack([np.cos(turn / 2), 0 * turn, 0 * turn, np.sin(turn / 2)], axis=1)
    root_pos = np.stack([0.5 * time, -0.2 * time, 0 * time + 0.8], axis=1)
    joint_pos = np.tile(0.3 * time[:, None], (1, 23))
    came = velocities(make_clip("turn", 50, root_pos, quat, joint_pos))
    np.testing.assert_allclose(came.root_lin_vel_w, np.tile([0.5, -0.2, 0], (100, 1)), atol=1e-4)
    np.testing.assert_allclose(came.root_ang_vel_b, np.tile([0, 0, 0.8], (100, 1)), atol=1e-4)
    np.testing.assert_allclose(came.joint_vel, np.full((100, 23), 0.3), atol=1e-4)


def test_angular_velocity_is_in_the_bodys_frame_and_blind_to_signs():
    lying = np.array([np.sqrt(0.5), np.sqrt(0.5), 0, 0])  # rolled by 90 degrees: the body's y is the world's z
    half = 0.3 * np.arange(30) / 50
    about_z = np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)
    from bumblebee.quaternions import multiply

    quat = multiply(about_z, lying)
    quat[::2] *= -1
    np.testing.assert_allclose(angular_velocity(quat, 50), np.tile([0, 0.6, 0], (30, 1)), atol=1e-6)


def test_contacts_are_feet_that_are_low_and_slow(motions):
    raw = motions.raw(60, 50.0)
    standing = make_clip("s", 50, raw.root_pos * [0, 0, 1], raw.root_quat[:1].repeat(60, 0), raw.joint_pos * 0)
    standing = make_clip(
        "s", 50, standing.root_pos - [0, 0, lowest_sole(standing)], standing.root_quat, standing.joint_pos
    )
    assert foot_contacts(standing).all()
    lifted = make_clip("up", 50, standing.root_pos + np.array([0, 0, 0.2]), standing.root_quat, standing.joint_pos)
    assert not foot_contacts(lifted).any()
    sliding = standing.root_pos + np.arange(60)[:, None] * [0.05, 0, 0]
    assert not foot_contacts(make_clip("slide", 50, sliding, standing.root_quat, standing.joint_pos)).any()


def lowest_sole(clip) -> float:
    points = sole_points(clip.root_pos, clip.root_quat, clip.joint_pos)
    assert points.shape == (clip.frames, len(FEET), 4, 3)
    return float(points[..., 2].min())
