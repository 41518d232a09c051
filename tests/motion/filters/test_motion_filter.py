"""Each rule drops exactly the motion that breaks it, with the right value at the right frame."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee import quaternions
from bumblebee.motion.clip import Clip
from bumblebee.motion.filters.rules import DROP_COLUMNS, RULES, FilterConfig, filter_clips, violations
from bumblebee.motion.kinematics import lowest, make_clip
from bumblebee.robot.facts import joint_names, joints

AT = 40  # the frame that the broken motions break at


def remade(clip: Clip, root_pos=None, joint_pos=None) -> Clip:
    root_pos = clip.root_pos if root_pos is None else root_pos
    joint_pos = clip.joint_pos if joint_pos is None else joint_pos
    return make_clip(clip.name, clip.fps, root_pos, clip.root_quat, joint_pos)


def raised(clip: Clip, height) -> Clip:
    return remade(clip, root_pos=clip.root_pos + np.multiply.outer(height, [0.0, 0.0, 1.0]))


def sunk(clip: Clip) -> Clip:
    return raised(clip, -0.08 * np.exp(-(((np.arange(clip.frames) - AT) / 8) ** 2)))


def floats(clip: Clip) -> Clip:
    return raised(clip, np.full(clip.frames, 0.12))


def flies(clip: Clip) -> Clip:
    frames = np.arange(clip.frames)
    return raised(clip, 0.3 * np.clip(np.minimum(frames - AT, AT + 66 - frames) / 8, 0, 1))


def bends_too_far(clip: Clip) -> Clip:
    joint_pos = np.array(clip.joint_pos)
    knee = joint_names().index("left_knee_joint")
    bump = np.exp(-(((np.arange(clip.frames) - AT) / 15) ** 2))
    top = joints()[knee].range[1] + 0.2
    joint_pos[:, knee] += (top - joint_pos[:, knee]) * bump
    return remade(clip, joint_pos=joint_pos)


def falls_and_rises(clip: Clip) -> Clip:
    joint_pos = np.array(clip.joint_pos)
    bend = 1.35 * np.exp(-(((np.arange(clip.frames) - AT) / 8) ** 2))
    for name, share in (("hip_pitch", -1.0), ("knee", 2.0), ("ankle_pitch", -0.2)):
        both = [joint_names().index(f"{side}_{name}_joint") for side in ("left", "right")]
        joint_pos[:, both] += share * bend[:, None]
    root_pos = np.array(clip.root_pos)
    root_pos[:, 2] -= lowest(root_pos, clip.root_quat, joint_pos)
    return remade(clip, root_pos, joint_pos)


def leaps_aside(clip: Clip) -> Clip:
    root_pos = np.array(clip.root_pos)
    root_pos[AT + 1 :, 1] += 0.15  # 7.5 m/s at 50 Hz: the pelvis jumps, no body reaches 15 m/s
    return remade(clip, root_pos=root_pos)


def turns_too_fast(clip: Clip) -> Clip:
    joint_pos = np.array(clip.joint_pos)
    joint_pos[AT + 1 :, joint_names().index("left_shoulder_yaw_joint")] += 0.95  # 47.5 rad/s
    return remade(clip, joint_pos=joint_pos)


def keypoint_too_fast(clip: Clip) -> Clip:
    key_pos = np.array(clip.key_pos)
    share = np.clip((np.arange(clip.frames) - AT + 10) / 20, 0, 1)
    key_pos[:, 10, 1] += 5.33 * share**2 * (3 - 2 * share)  # 20 m/s, without a jerk; sane joints alone do not do it
    return replace(clip, key_pos=key_pos)


def jerks_for_a_frame(clip: Clip) -> Clip:
    key_pos = np.array(clip.key_pos)
    key_pos[AT, 10] += [0.0, 0.14, 0.0]  # 7 m/s there and back again
    return replace(clip, key_pos=key_pos)


def glides(clip: Clip) -> Clip:
    return remade(clip, root_pos=clip.root_pos + np.multiply.outer(np.arange(clip.frames) / 50, [0.0, 0.8, 0.0]))


def turned(clip: Clip, quat) -> Clip:
    root_quat = quaternions.multiply(quat, clip.root_quat)
    root_pos = np.array(clip.root_pos)
    root_pos[:, 2] -= lowest(root_pos, root_quat, clip.joint_pos)
    return make_clip(clip.name, clip.fps, root_pos, root_quat, clip.joint_pos)


def spins_in_a_frame(clip: Clip) -> Clip:
    angle = np.where(np.arange(clip.frames) > AT, 0.36, 0.0)  # 18 rad/s
    return turned(clip, quaternions.from_axis_angle([0.0, 0.0, 1.0], angle))


def lies(clip: Clip) -> Clip:
    return turned(clip, quaternions.from_axis_angle([0.0, 1.0, 0.0], np.full(clip.frames, np.pi / 2)))


def arm_in_the_chest(clip: Clip) -> Clip:
    joint_pos = np.array(clip.joint_pos)
    arm = [joint_names().index(f"left_{name}_joint") for name in ("shoulder_pitch", "shoulder_roll", "shoulder_yaw")]
    away = np.array([1.03, -0.95, -0.55, 1.81]) - joint_pos[:, [*arm, arm[-1] + 1]]
    frames = np.arange(clip.frames)
    there = np.clip(np.minimum(frames - AT + 20, AT + 80 - frames) / 20, 0, 1)
    joint_pos[:, [*arm, arm[-1] + 1]] += there[:, None] * away
    return remade(clip, joint_pos=joint_pos)


CASES = {
    "floor_penetration": (sunk, 0.08, 0.005, AT),
    "floating": (floats, 0.12, 0.005, None),
    "airborne": (flies, 1.15, 0.1, AT + 6),
    "joint_limits": (bends_too_far, 0.2, 0.001, AT),
    "body_speed": (keypoint_too_fast, 20.0, 1.0, AT),
    "joint_speed": (turns_too_fast, 47.5, 1.0, AT),
    "root_dip": (falls_and_rises, 0.5, 0.03, AT),
    "root_jump": (leaps_aside, 7.5, 0.2, AT),
    "root_turn": (spins_in_a_frame, 18.0, 0.3, AT),
    "spike": (jerks_for_a_frame, 700.0, 30.0, AT),
    "skate": (glides, 0.85, 0.1, None),
    "self_collision": (arm_in_the_chest, 1.2, 0.2, None),
    "other_contact": (lies, 2.98, 0.1, None),
}


def test_every_rule_has_its_case():
    assert set(CASES) == {rule.__name__ for rule in RULES}


@pytest.mark.parametrize("rule", CASES)
def test_a_rule_drops_the_motion_that_breaks_it_and_no_other_does(motions, rule):
    broken, value, tolerance, frame = CASES[rule]
    clip = broken(motions.clip("bad", 150))
    rows = violations(clip)
    if rule in ("joint_limits", "root_dip"):  # a knee bent this far also lifts the foot: only the limit counts
        rows = [row for row in rows if row["rule"] == rule]
    assert [row["rule"] for row in rows] == [rule]
    assert rows[0]["value"] == pytest.approx(value, abs=tolerance)
    assert frame is None or abs(rows[0]["frame"] - frame) <= 1
    assert rows[0]["time"] == pytest.approx(rows[0]["frame"] / 50, abs=1e-3)
    assert rows[0]["unit"] in rows[0]["explanation"] and "limit" in rows[0]["explanation"]


def test_a_sane_motion_breaks_none_and_short_hops_are_no_flight(motions):
    clip = motions.clip("good", 150)
    assert violations(clip) == []
    hop = 0.3 * np.clip(1 - ((np.arange(150) - 75) / 15) ** 2, 0, None)
    assert violations(raised(clip, hop)) == []


def test_the_table_has_a_row_for_each_rule_broken_and_the_rest_is_kept(motions):
    good, bad = motions.clip("good", 150), turns_too_fast(sunk(motions.clip("bad", 150)))
    kept, drops = filter_clips([good, bad])
    assert [clip.name for clip in kept] == ["good"]
    assert list(drops.columns) == list(DROP_COLUMNS)
    assert drops[["motion", "rule"]].to_numpy().tolist() == [["bad", "floor_penetration"], ["bad", "joint_speed"]]


def test_the_limits_are_settings(motions):
    clip = turns_too_fast(motions.clip("fast", 150))
    assert violations(clip, FilterConfig(joint_speed=50.0)) == []


def test_a_single_frame_has_no_speed(motions):
    clip = motions.clip("one", 12)
    one = replace(clip, **{name: getattr(clip, name)[:1] for name in ("root_pos", "root_quat", "joint_pos", "key_pos")})
    assert violations(one) == []
