"""Written motions read back as they were, and are as other programs expect, judged by their rules."""

import io
from dataclasses import replace
from pathlib import Path

import joblib
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bumblebee.motion.clip import velocities
from bumblebee.motion.formats.body_motion import body_motion
from bumblebee.motion.formats.read import RobotConfig, read_robot
from bumblebee.motion.formats.write import FORMATS, asap_pickle, g1_csv, mjlab_npz, wide, write_motion
from bumblebee.motion.kinematics import make_clip
from bumblebee.motion.resample import resample
from bumblebee.robot.facts import joint_names, joints, robot_bodies
from bumblebee.robot.model import RobotConfig as ModelConfig
from bumblebee.robot.model import build_model

RATES = (24.0, 30.0, 50.0, 59.94, 120.0)


def lively(motions, fps=50.0, frames=90):
    """A clip that turns and leans about every axis."""
    raw = motions.raw(frames, fps)
    time = np.arange(frames) / fps
    turn = np.stack([0.2 * np.sin(3 * time), 0.3 * np.cos(2 * time), 1.5 * time], axis=1)
    quat = Rotation.from_rotvec(turn).as_quat()[:, [3, 0, 1, 2]]
    return make_clip("spin.v2", fps, raw.root_pos + turn / 9, quat, raw.joint_pos, captions=("turns.#a/B#0#0",))


def read(clip, kind, fps):
    (raw,) = read_robot(clip_path(kind), FORMATS[kind].content(clip), RobotConfig(csv_fps=fps))
    return make_clip(clip.name, raw.fps, raw.root_pos, raw.root_quat, raw.joint_pos)


def clip_path(kind):
    return Path(f"a{FORMATS[kind].suffix}")


def same(came, clip):
    assert came.fps == clip.fps
    for name in ("root_pos", "root_quat", "joint_pos", "key_pos"):
        np.testing.assert_allclose(getattr(came, name), getattr(clip, name), rtol=0, atol=2.5e-7)


@pytest.mark.parametrize("fps", RATES)
@pytest.mark.parametrize("kind", sorted(FORMATS))
def test_every_format_gives_back_the_clip_at_every_rate(motions, kind, fps):
    clip = lively(motions, fps)
    came = read(clip, kind, fps)
    same(came, clip)
    np.testing.assert_array_equal(came.joint_pos, clip.joint_pos)


@pytest.mark.parametrize("then", sorted(FORMATS))
@pytest.mark.parametrize("first", sorted(FORMATS))
def test_one_format_after_the_other_loses_nothing(motions, first, then):
    clip = lively(motions)
    same(read(read(clip, first, 50.0), then, 50.0), clip)


def test_23_columns_come_back_as_29_do(motions):
    clip = lively(motions)
    (raw,) = read_robot(clip_path("g1_csv"), g1_csv(clip, every=False), RobotConfig(csv_fps=50, joints_23="asap"))
    np.testing.assert_array_equal(raw.joint_pos.astype(np.float32), clip.joint_pos)
    assert (
        g1_csv(clip, every=False).splitlines()[0].count(b",") == 29 and g1_csv(clip).splitlines()[0].count(b",") == 35
    )


def test_a_rate_that_divides_another_comes_back_on_its_frames(motions):
    clip = lively(motions, 60.0)
    (raw,) = read_robot(clip_path("asap"), asap_pickle(clip), None)
    there = resample(raw, 120.0)
    (raw,) = read_robot(clip_path("asap"), asap_pickle(replace(clip, **arrays(there), fps=120.0)), None)
    back = resample(raw, 60.0)
    np.testing.assert_allclose(back.joint_pos, clip.joint_pos, atol=2.5e-7)
    np.testing.assert_allclose(back.root_pos, clip.root_pos, atol=2.5e-7)


def arrays(raw):
    clip = make_clip("a", raw.fps, raw.root_pos, raw.root_quat, raw.joint_pos)
    return {name: getattr(clip, name) for name in ("root_pos", "root_quat", "joint_pos", "key_pos")}


def test_body_velocities_are_those_of_the_simulator(motions):
    clip = lively(motions)
    found, rates = body_motion(clip), velocities(clip)
    model = build_model(ModelConfig(every_joint=True))
    data, speed = mujoco.MjData(model), np.empty(6)
    for row in (0, 33, clip.frames - 1):
        data.qpos[:] = np.concatenate([clip.root_pos[row], clip.root_quat[row], wide(clip.joint_pos)[row]])
        joint_vel = wide(rates.joint_vel)[row]
        data.qvel[:] = np.concatenate([rates.root_lin_vel_w[row], rates.root_ang_vel_b[row], joint_vel])
        mujoco.mj_forward(model, data)
        for column, body in enumerate(robot_bodies()):
            body_id = model.body(body).id
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body_id, speed, 0)
            np.testing.assert_allclose(found.ang_vel[row, column], speed[:3], atol=1e-6)
            np.testing.assert_allclose(found.lin_vel[row, column], speed[3:], atol=1e-6)
            np.testing.assert_allclose(found.pos[row, column], data.xpos[body_id], atol=1e-6)
            turned = abs(np.dot(found.quat[row, column], data.xquat[body_id]))
            assert turned == pytest.approx(1, abs=1e-6)


def test_mjlab_gets_its_arrays_its_order_and_float32(motions):
    clip = lively(motions)
    with np.load(io.BytesIO(mjlab_npz(clip)), allow_pickle=False) as file:
        found = dict(file)
    frames = clip.frames
    shapes = {"fps": (1,), "joint_pos": (frames, 29), "joint_vel": (frames, 29), "body_pos_w": (frames, 30, 3),
              "body_quat_w": (frames, 30, 4), "body_lin_vel_w": (frames, 30, 3),
              "body_ang_vel_w": (frames, 30, 3)}  # fmt: skip
    assert {key: value.shape for key, value in found.items()} == shapes
    assert {value.dtype for key, value in found.items() if key != "fps"} == {np.dtype(np.float32)}
    model = build_model(ModelConfig(every_joint=True))  # its tree is that of mjlab's MJCF
    assert [model.body(i).name for i in range(1, model.nbody)] == list(robot_bodies())
    np.testing.assert_array_equal(found["body_pos_w"][:, 0], clip.root_pos)
    np.testing.assert_array_equal(found["body_quat_w"][:, 0], clip.root_quat)
    knee = [model.joint(i).name for i in range(1, model.njnt)].index("left_knee_joint")
    np.testing.assert_array_equal(
        found["joint_pos"][:, knee], clip.joint_pos[:, joint_names().index("left_knee_joint")]
    )


def test_asap_finds_its_fields_under_the_files_name(motions, tmp_path):
    clip = lively(motions)
    path = write_motion(tmp_path, clip, "asap")
    motion = joblib.load(path)[path.name.split(".")[0]]  # as ASAP's motion library does
    assert motion["pose_aa"].shape == (clip.frames, 27, 3) and motion["pose_aa"].dtype == np.float32
    root = Rotation.from_rotvec(motion["pose_aa"][:, 0]).as_quat()
    np.testing.assert_allclose(np.abs((root * motion["root_rot"]).sum(axis=1)), 1, atol=1e-6)
    axes = np.array([joint.axis for joint in joints()])
    np.testing.assert_allclose((motion["pose_aa"][:, 1:24] * axes).sum(axis=2), motion["dof"], atol=1e-7)
    assert motion["fps"] == 50 and isinstance(motion["fps"], int) and not motion["pose_aa"][:, 24:].any()
