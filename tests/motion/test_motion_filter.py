"""Each rule drops exactly the motion that breaks it, with the right value at the right frame."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.motion.clip import Clip
from bumblebee.motion.filter import DROP_COLUMNS, RULES, FilterConfig, filter_clips, violations
from bumblebee.motion.kinematics import make_clip
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
    key_pos[AT + 1 :, 10] += [0.0, 0.4, 0.0]  # 20 m/s: with sane joints a keypoint alone does not do it
    return replace(clip, key_pos=key_pos)


CASES = {
    "floor_penetration": (sunk, 0.08, 0.005, AT),
    "floating": (floats, 0.12, 0.005, None),
    "airborne": (flies, 1.15, 0.1, AT + 6),
    "joint_limits": (bends_too_far, 0.2, 0.001, AT),
    "body_speed": (keypoint_too_fast, 20.0, 1.0, AT),
    "joint_speed": (turns_too_fast, 47.5, 1.0, AT),
    "root_jump": (leaps_aside, 7.5, 0.2, AT),
}


def test_every_rule_has_its_case():
    assert set(CASES) == {rule.__name__ for rule in RULES}


@pytest.mark.parametrize("rule", CASES)
def test_a_rule_drops_the_motion_that_breaks_it_and_no_other_does(motions, rule):
    broken, value, tolerance, frame = CASES[rule]
    clip = broken(motions.clip("bad", 150))
    rows = violations(clip)
    if rule == "joint_limits":  # a knee bent this far also lifts the foot: only the limit counts
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
