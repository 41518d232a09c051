"""The fit over the whole trajectory: what it must keep whatever the person does."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.retarget.landmarks import person_of
from bumblebee.motion.filters.quality import quality
from bumblebee.motion.human.motion import HumanMotion
from bumblebee.motion.kinematics import lowest, make_clip, sole_points
from bumblebee.motion.raw import RawMotion
from bumblebee.motion.retarget import retarget as module
from bumblebee.motion.retarget.retarget import retarget
from bumblebee.robot.facts import joint_names, joints, stand_pose
from tests.motion.retarget.stepping import FPS, changed, jump, mirrored, standing, steps, turned


@pytest.fixture(scope="module")
def walked() -> RawMotion:
    return retarget(steps()[0])


def _yaw(raw: RawMotion) -> np.ndarray:
    return Rotation.from_quat(np.roll(raw.root_quat, -1, axis=1)).as_matrix()


@pytest.mark.parametrize("angle", [0.7, np.pi])
def test_a_person_turned_and_shifted_turns_and_shifts_the_robot_and_no_joint(walked, angle):
    moved = retarget(changed(turned(steps()[0], angle), lambda p: p + np.array([2.0, 1.0, 0.0])))
    assert np.abs(moved.joint_pos - walked.joint_pos).max() < 0.02
    turn = Rotation.from_euler("z", angle).as_matrix()
    assert np.abs(_yaw(moved) - turn @ _yaw(walked)).max() < 0.02
    shift = moved.root_pos - walked.root_pos @ turn.T
    assert np.ptp(shift, axis=0).max() < 0.005


def test_a_child_moves_the_robot_as_an_adult_does(walked):
    child = retarget(changed(steps()[0], lambda p: 0.6 * p))
    np.testing.assert_allclose(child.joint_pos, walked.joint_pos, atol=0.01)
    np.testing.assert_allclose(child.root_pos, walked.root_pos, atol=0.002)


def test_a_mirrored_person_gives_mirrored_joints(walked):
    other = retarget(mirrored(steps()[0]))
    names = joint_names()
    pairs = [names.index(n.replace("left", "L").replace("right", "left").replace("L", "right")) for n in names]
    sign = np.where([("roll" in n or "yaw" in n) for n in names], -1, 1)
    assert np.abs(other.joint_pos[:, pairs] * sign - walked.joint_pos).max() < 0.02
    assert np.abs(other.root_pos * [1, -1, 1] - walked.root_pos).max() < 0.005


def test_feet_that_stand_neither_slide_nor_sink_nor_float(walked):
    motion, known = steps()
    clip = make_clip("steps", FPS, walked.root_pos, walked.root_quat, walked.joint_pos)
    found = quality(clip, motion.positions)
    assert found["penetration_mm"] < 5 and found["floating_mm"] < 5 and found["skate_mm_s"] < 20
    low = sole_points(walked.root_pos, walked.root_quat, walked.joint_pos)[..., 2].min(axis=2)
    air = ~known & (motion.positions[:, [3, 7], 2] > 0.15)
    assert low[air].min() > 0.01  # and a foot in the air is in the air


def test_a_jump_keeps_its_flight():
    motion, up = jump()
    raw = retarget(motion)
    low = lowest(raw.root_pos, raw.root_quat, raw.joint_pos)
    scale = np.ptp(raw.root_pos[:, 2]) / up.max()
    assert 0.5 < scale < 0.8  # the legs' lengths
    assert low.max() > 0.5 * up.max()
    assert np.abs(low[:20]).max() < 0.005 and np.abs(low[-20:]).max() < 0.005


def test_ranges_and_speeds_are_kept_when_a_person_breaks_them():
    time = np.arange(80) / FPS
    angle = 3.2 * np.sin(2 * np.pi * 3 * time)  # rad: 60 rad/s, further than a shoulder goes
    arm = 0.28 * np.stack([np.sin(angle), 0 * angle, -np.cos(angle)], axis=1)
    motion = standing(80, elbows=np.stack([arm, arm], axis=1), wrists=0.9 * np.stack([arm, -arm], axis=1))
    raw = retarget(motion)
    low, high = np.array([joint.range for joint in joints()]).T
    fastest = np.array([joint.velocity_limit for joint in joints()])
    assert (raw.joint_pos >= low).all() and (raw.joint_pos <= high).all()
    assert (np.abs(np.diff(raw.joint_pos, axis=0)) * FPS <= 1.02 * fastest).all()


def test_a_person_whose_landmarks_are_the_robots_own_is_recovered():
    time = np.arange(100) / FPS
    swing = np.sin(2 * np.pi * 0.8 * time)[:, None]
    arms = np.array([float(any(part in n for part in ("shoulder", "elbow", "waist"))) for n in joint_names()])
    apart = np.array([0.3 * ("left_shoulder_roll" in n) - 0.3 * ("right_shoulder_roll" in n) for n in joint_names()])
    joint = stand_pose() + 0.2 * swing * arms + apart  # the feet stand, the hands are clear of the hips
    root = np.tile([0.0, 0.0, 0.8], (100, 1))
    quat = np.tile([1.0, 0, 0, 0], (100, 1))
    root[:, 2] -= lowest(root, quat, joint)
    person = person_of(make_clip("own", FPS, root, quat, joint))
    raw = retarget(person)
    found = person_of(make_clip("found", FPS, raw.root_pos, raw.root_quat, raw.joint_pos)).positions
    away = np.linalg.norm(found - person.positions, axis=-1)
    assert 1000 * away.mean() < 10 and 1000 * away.max() < 40


def test_a_long_motion_in_parts_is_the_one_piece_solution(monkeypatch):
    motion = steps(5)[0]
    whole = retarget(motion)
    monkeypatch.setattr(module, "_LONGEST", 100)
    monkeypatch.setattr(module, "_OVERLAP", 30)
    parts = retarget(motion)
    assert len(module._parts(len(whole.root_pos))) > 1
    assert np.abs(parts.joint_pos - whole.joint_pos).max() < 0.1
    assert np.linalg.norm(parts.root_pos - whole.root_pos, axis=1).max() < 0.02
    step, usual = (np.abs(np.diff(r.joint_pos, axis=0)).max() for r in (parts, whole))
    assert step < 1.2 * usual + 0.01  # no jump at a seam


@pytest.mark.parametrize("frames", [5, 59, 60, 61, 599, 600, 601, 659, 660, 661, 2000, 100_000])
def test_parts_cover_all_frames_and_share_the_overlap(frames):
    parts = module._parts(frames)
    assert parts[0][0] == 0 and parts[-1][1] == frames
    assert all(a[1] - b[0] == module._OVERLAP for a, b in pairwise(parts))
    assert all(end - start <= module._LONGEST + 1 for start, end in parts)


@pytest.mark.parametrize("frames", [*range(5, 21, 3)])
def test_a_few_frames_are_enough(frames):
    raw = retarget(standing(frames))
    assert len(raw.root_pos) == frames and np.isfinite(raw.joint_pos).all()
    low = lowest(raw.root_pos, raw.root_quat, raw.joint_pos)
    assert np.abs(low).max() < 0.005


def test_the_first_frame_is_no_worse_than_the_rest(walked):
    step = np.abs(np.diff(walked.joint_pos, axis=0)).max(axis=1)
    assert step[:3].max() < 1.2 * step.max()


def test_results_repeat_to_the_digit(walked):
    again = retarget(steps()[0])
    for name in ("root_pos", "root_quat", "joint_pos"):
        np.testing.assert_array_equal(getattr(again, name), getattr(walked, name))


@pytest.mark.parametrize("fps", [30.0, 120.0])
def test_any_rate_of_file_and_robot(fps):
    raw = retarget(steps(2, fps)[0], 60.0)
    assert raw.fps == 60.0 and abs(len(raw.root_pos) / 60 - len(steps(2, fps)[0].positions) / fps) < 0.05


def test_a_floor_that_moves_is_noted():
    motion = steps(5)[0]
    rising = changed(motion, lambda p: p + np.linspace(0, 0.5, len(p))[:, None, None] * [0, 0, 1])
    assert any("the floor under the person moves by" in note for note in retarget(rising).notes)
    assert retarget(HumanMotion("s", FPS, standing().positions, motion.file)).notes == ()
