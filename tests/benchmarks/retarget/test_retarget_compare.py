"""The comparison of retargeters: a perfect one has no error, a person's size does not matter, tables name the worst."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.retarget.compare import compare, judged
from benchmarks.retarget.frames import orientations
from benchmarks.retarget.landmarks import person_of, robot_landmarks, scaled
from benchmarks.retarget.table import markdown, summary
from bumblebee import quaternions
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import forward_bodies, lowest, make_clip
from bumblebee.motion.raw import RawMotion
from bumblebee.robot.facts import joint_names, stand_pose


@pytest.fixture
def clip() -> Clip:
    time = np.arange(60) / 50.0
    joint_pos = np.tile(stand_pose(), (60, 1))
    joint_pos[:, joint_names().index("left_elbow_joint")] += 0.4 * np.sin(3 * time)
    root_quat = np.stack([np.cos(0.2 * time), 0 * time, 0 * time, np.sin(0.2 * time)], axis=1)
    root_pos = np.stack([0.1 * time, 0 * time, 0 * time], axis=1)
    root_pos[:, 2] -= lowest(root_pos, root_quat, joint_pos)
    return make_clip("wave", 50.0, root_pos, root_quat, joint_pos)


def raw_of(clip: Clip, joint_pos: np.ndarray | None = None) -> RawMotion:
    joints = clip.joint_pos if joint_pos is None else joint_pos
    return RawMotion(clip.name, clip.fps, clip.root_pos, clip.root_quat, joints, Path("made"))


def test_who_gives_the_reference_back_has_no_error_and_who_bends_an_elbow_has(clip: Clip):
    bent = np.array(clip.joint_pos)
    bent[:, joint_names().index("right_elbow_joint")] += 0.23
    retargeters = {"same": lambda motion: raw_of(clip), "bent": lambda motion: raw_of(clip, bent)}
    found = compare(retargeters, [(person_of(clip), clip)])
    same, off = found["same"]["wave"], found["bent"]["wave"]
    assert (same["joint_rad"], same["keypoint_mm"]) == pytest.approx((0, 0), abs=1e-4)
    assert same["landmark_mm"] < 15  # the leg's length varies with the hip's yaw, by which the person is scaled
    assert off["joint_rad"] == pytest.approx(0.01, abs=1e-4)
    assert off["landmark_mm"] > same["landmark_mm"] + 1


def test_a_person_of_twice_the_size_is_scaled_to_the_same_targets(clip: Clip):
    positions = robot_landmarks(clip.root_pos, clip.root_quat, clip.joint_pos)
    assert scaled(2 * positions) == pytest.approx(scaled(positions), abs=1e-9)


def test_orientations_from_landmarks_are_those_of_the_bodies_and_turn_with_the_person(clip: Clip):
    found = orientations(robot_landmarks(clip.root_pos, clip.root_quat, clip.joint_pos))
    poses = forward_bodies(clip.root_pos, clip.root_quat, clip.joint_pos)
    for body, turn in found.items():
        assert np.linalg.det(turn) == pytest.approx(np.ones(clip.frames))
        axes = [quaternions.rotate(poses[body][1], axis) for axis in np.eye(3)]
        cosines = [np.sum(turn[..., i] * axes[i], axis=-1).min() for i in range(3)]
        assert min(cosines) > np.cos(np.radians(32)), body  # the thigh's line is not quite that of its link
    soles = found["left_ankle_roll_link"][..., 2]
    assert np.degrees(np.arccos(soles[:, 2])).max() < 3


def test_a_retargeter_of_another_rate_is_judged_at_the_rate_of_the_clips(clip: Clip):
    half = person_of(clip)
    half = replace(half, fps=25.0, positions=half.positions[::2])
    row = judged(
        lambda motion: replace(
            raw_of(clip), fps=25.0, **{n: getattr(clip, n)[::2] for n in ("root_pos", "root_quat", "joint_pos")}
        ),
        half,
        clip,
    )
    assert row["joint_rad"] == pytest.approx(0, abs=1e-3)
    assert row["contact_share"] == 1.0


def test_a_summary_names_the_worst_motion_and_leaves_out_what_could_not_be_measured():
    rows = {"a": {"skate": 1.0}, "b": {"skate": 5.0}, "c": {"skate": float("nan")}}
    found = summary(rows)["skate"]
    assert (found["mean"], found["n"], found["worst"], found["worst_motion"]) == (3.0, 2, 5.0, "b")
    assert found["low"] == 0.0 and found["high"] > 5  # two motions say little; nothing is slower than 0
    assert "5 `b`" in markdown({"set": {"skate": found}})
    assert summary({"c": rows["c"]})["skate"]["mean"] is None


def test_the_baseline_follows_a_motion_that_the_robot_can_do(clip: Clip):
    pytest.importorskip("mink")
    from benchmarks.retarget.mink_baseline import retarget

    row = judged(retarget, person_of(clip), clip)
    assert row["keypoint_local_mm"] < 30 and row["limit_frames"] == 0
