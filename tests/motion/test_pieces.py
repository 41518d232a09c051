"""Cutting loses no frame; the split into training and held-out motions hangs on names alone."""

from dataclasses import replace

import numpy as np
import pytest

from bumblebee.motion.pieces import hold_out, motion_of, origin, split_long, too_few


@pytest.mark.parametrize("seconds", [0.5, 0.8, 1.0, 1.59])
def test_pieces_are_short_and_make_up_the_whole(motions, seconds):
    clip = motions.clip("walk", 81, family="walk")
    pieces = split_long(clip, seconds)
    assert [piece.name for piece in pieces] == [f"walk_p{i}" for i in range(len(pieces))]
    assert max(piece.duration for piece in pieces) <= seconds + 1e-9
    assert max(p.frames for p in pieces) - min(p.frames for p in pieces) <= 1
    for field in ("root_pos", "root_quat", "joint_pos", "key_pos"):
        np.testing.assert_array_equal(np.concatenate([getattr(p, field) for p in pieces]), getattr(clip, field))
    assert {(p.family, motion_of(p.name)) for p in pieces} == {("walk", "walk")}


@pytest.mark.parametrize("seconds", [1.6, 5.0, 0.0])
def test_short_motions_and_a_limit_of_0_stay_whole(motions, seconds):
    clip = motions.clip("walk", 81)
    assert split_long(clip, seconds) == [clip]


def named(clip, names: list[str], family: str = "walk"):
    return [replace(clip, name=name, family=family) for name in names]


def held(clips) -> set[str]:
    return {clip.name for clip in clips if clip.split == "test"}


def test_the_split_hangs_on_names_alone(motions):
    clips = named(motions.clip("x", 12), [f"walk{i}" for i in range(40)])
    forward, backward = hold_out(clips, 0.3), hold_out(clips[::-1], 0.3)
    assert held(forward) == held(backward)
    assert len(held(forward)) == 12
    assert [clip.name for clip in forward] == [clip.name for clip in clips]
    assert held(forward) != {clip.name for clip in clips[:12]}


@pytest.mark.parametrize(("size", "least"), [(4, 1), (12, 1)])
def test_a_family_of_four_has_one_held_out_and_one_left(motions, size, least):
    clip = motions.clip("x", 12)
    for share in (1e-9, 0.15, 0.999):
        names = [f"jump{i}" for i in range(size)]
        count = len(held(hold_out(named(clip, names, "jump"), share)))
        assert least <= count <= size - 1
    few = named(clip, ["a_p0", "a_p1", "b", "c"], "jump")
    assert held(hold_out([*few, *named(clip, ["d", "e"])], 0.9)) == set()
    assert too_few(few) == "it takes 4 motions of one kind, by their names; the largest, 'jump', has 3"


def test_pieces_of_one_motion_stay_together(motions):
    clips = named(motions.clip("x", 12), [f"walk{i}_p{j}" for i in range(8) for j in range(3)])
    sides = {
        motion: {c.split for c in hold_out(clips, 0.4) if motion_of(c.name) == motion}
        for motion in map(motion_of, {c.name for c in clips})
    }
    assert all(len(side) == 1 for side in sides.values())
    assert {split for side in sides.values() for split in side} == {"train", "test"}


def test_a_share_of_0_holds_nothing_out(motions):
    assert held(hold_out(named(motions.clip("x", 12), list("abcdefgh")), 0.0)) == set()


@pytest.mark.parametrize(
    ("name", "source", "own"),
    [
        ("walk", "a/walk.bvh", "walk"),
        ("b_walk", "b/walk.npz", "walk"),  # told apart by the folder
        ("b_walk_2", "b/walk.csv", "walk"),  # and by a number
        ("b_walk_p3", "b/walk.npz", "walk"),
        ("01_01", "01/01_01.bvh", "01_01"),
        ("cmu_01_01", "cmu/01_01.npz", "01_01"),  # a number of its own
        ("cmu_01_01_2", "cmu/01_01.csv", "01_01"),
        ("many_kick", "many/all.pkl", "kick"),  # one of several in its file
        ("kick_2", "many/all.pkl", "kick_2"),
        ("walk_forward", "made by us", "walk_forward"),
    ],
)
def test_a_motion_is_known_by_its_name_in_its_own_file(name, source, own):
    assert origin(name, source) == own


def test_one_motion_in_several_folders_goes_to_one_side(motions):
    clip = motions.clip("x", 12)
    clips = []
    for number in range(12):
        stem = f"{number:02}_{number:02}"
        clips += [replace(clip, name=stem, source=f"person/{stem}.bvh", family="walk"),
                  replace(clip, name=f"robot_{stem}", source=f"robot/{stem}.pkl", family="walk"),
                  replace(clip, name=f"robot_{stem}_2", source=f"robot/{stem}.csv", family="walk")]  # fmt: skip
    split = {one.name: one.split for one in hold_out(clips, 0.3)}
    for number in range(12):
        stem = f"{number:02}_{number:02}"
        assert split[stem] == split[f"robot_{stem}"] == split[f"robot_{stem}_2"]
    assert sum(side == "test" for side in split.values()) == 3 * 4
