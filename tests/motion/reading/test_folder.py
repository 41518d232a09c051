"""A folder of everything gives its motions and a table of the rest; one bad file stops nothing."""

import hashlib
import zipfile

import joblib
import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.checks import MIN_FRAMES
from bumblebee.motion.describe.describer import DescribeConfig
from bumblebee.motion.kinematics import forward_key_positions
from bumblebee.motion.reading.folder import ReadConfig, read_file, read_folder
from bumblebee.motion.store import write_library
from bumblebee.robot.facts import joint_names

CONFIG = ReadConfig(csv_fps=30)


def test_csv_and_pickle_of_one_motion_give_the_same_clip(motions):
    raw = motions.raw(frames=61)
    from_csv, from_pickle = read_file(motions.csv(raw), CONFIG)[0], read_file(motions.pickle(raw), CONFIG)[0]
    for clip in (from_csv, from_pickle):
        assert (clip.fps, clip.frames, clip.joint_pos.shape) == (50.0, 101, (101, len(joint_names())))
        wanted = forward_key_positions(clip.root_pos, clip.root_quat, clip.joint_pos)
        np.testing.assert_allclose(clip.key_pos, wanted, atol=1e-5)
    for field in ("root_pos", "root_quat", "joint_pos"):
        np.testing.assert_allclose(getattr(from_csv, field), getattr(from_pickle, field), atol=1e-5)


def test_a_clip_says_where_it_comes_from(motions):
    path = motions.csv(motions.raw(), "walks/B_SideWalk.csv")
    (path.parent / "LICENSE").write_text("MIT License")
    (clip,) = read_file(path, CONFIG)
    assert (clip.source, clip.licence, clip.family) == ("walks/B_SideWalk.csv", "MIT", "walk")
    assert clip.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert (clip.caption_source, clip.captions) == ("", ())
    (clip,) = read_file(path, ReadConfig(csv_fps=30, describe=DescribeConfig(name_words=True)))
    assert clip.caption_source == "name" and clip.captions[0].startswith("a person performs side walk#")
    path.with_suffix(".txt").write_text("a person walks.#a/DET#0.0#0.0\n")
    (clip,) = read_file(path, CONFIG)
    assert clip.caption_source == "file" and clip.captions == ("a person walks.#a/DET#0.0#0.0",)


def test_a_mixed_folder_is_read_and_its_rest_listed(motions, tmp_path):
    raw = motions.raw()
    motions.csv(raw, "a/walk.csv")
    motions.pickle(raw, "b/jump.pkl")
    motions.csv(motions.raw(frames=3), "a/short.csv")
    (tmp_path / "b/cut.pkl").write_bytes((tmp_path / "b/jump.pkl").read_bytes()[:500])
    np.savez(tmp_path / "c.npz", poses=np.zeros((3, 72)))
    with zipfile.ZipFile(tmp_path / "d.zip", "w") as archive:
        archive.writestr("x/1.bvh", "")
        archive.writestr("x/2.bvh", "")
    (tmp_path / "e.xyz").write_text("?")
    (tmp_path / "README.md").write_text("notes")
    (tmp_path / "a/walk.txt").write_text("a person walks.#a/DET#0.0#0.0")
    done = []
    reading = read_folder(tmp_path, CONFIG, lambda: done.append(1))
    assert sorted(clip.name for clip in reading.clips) == ["jump", "walk"]
    reasons = dict(zip(reading.skipped["file"], reading.skipped["reason"], strict=True))
    assert set(reasons) == {"a/short.csv", "b/cut.pkl", "c.npz", "d.zip/x/1.bvh", "d.zip/x/2.bvh", "e.xyz"}
    assert reasons["a/short.csv"] == f"expected at least {MIN_FRAMES} frames, came 3 frames"
    assert reasons["b/cut.pkl"].startswith("expected a whole pickle, came")
    assert "trans" in reasons["c.npz"]
    assert reasons["d.zip/x/1.bvh"] == reasons["d.zip/x/2.bvh"]
    assert reasons["e.xyz"].endswith("came a format that is not known")
    assert len(done) == 8


def test_equal_names_in_two_folders_stay_apart(motions, tmp_path):
    for folder in ("a", "b", "c/b"):
        motions.csv(motions.raw(), f"{folder}/walk.csv")
    names = [clip.name for clip in read_folder(tmp_path, CONFIG).clips]
    assert names == ["walk", "b_walk", "b_walk_2"]


def test_a_single_file_that_is_bad_raises(motions):
    with pytest.raises(BadInput, match="came 3 frames"):
        read_folder(motions.csv(motions.raw(frames=3)), CONFIG)


@pytest.mark.parametrize("what", ["nothing", "empty", "unusable"])
def test_a_folder_without_motions_is_an_error(tmp_path, what):
    folder = tmp_path / "m"
    if what != "nothing":
        folder.mkdir()
    if what == "unusable":
        (folder / "a.npz").write_bytes(b"x")
    with pytest.raises(BadInput, match="/m: expected"):
        read_folder(folder, CONFIG)


def test_a_library_in_the_folder_is_read_as_it_is(motions, tmp_path):
    clip = motions.clip("made", 40, family="walk", licence="MIT", sha256="ff")
    write_library(tmp_path / "in/lib", [clip])
    (came,) = read_folder(tmp_path / "in", CONFIG).clips
    np.testing.assert_array_equal(came.root_pos, clip.root_pos)
    assert (came.name, came.family, came.licence, came.sha256) == ("made", "walk", "MIT", "ff")


def test_long_motions_are_cut(motions):
    path = motions.csv(motions.raw(frames=61))
    clips = read_file(path, ReadConfig(csv_fps=30, max_seconds=0.8))
    assert [clip.name for clip in clips] == ["sway_p0", "sway_p1", "sway_p2"]
    assert sum(clip.frames for clip in clips) == 101


def test_names_are_safe_as_file_names(motions):
    (clip,) = read_file(motions.csv(motions.raw(), "weird name (1)#.csv"), CONFIG)
    assert clip.name == "weird_name_1"


def test_a_bad_motion_of_a_pickle_does_not_cost_the_others(motions, tmp_path):
    bad = motions.fields(motions.raw())
    bad["dof"] = bad["dof"] * 60
    joblib.dump(
        {"a": motions.fields(motions.raw()), "b": bad, "c": motions.fields(motions.raw())}, tmp_path / "all.pkl"
    )
    for cache in (None, tmp_path / "cache", tmp_path / "cache"):
        reading = read_folder(tmp_path / "all.pkl", CONFIG, cache=cache)
        assert [clip.name for clip in reading.clips] == ["all_a", "all_c"]
        ((file, reason),) = reading.skipped.itertuples(index=False, name=None)
        assert file == "all.pkl, b" and "expected radians" in reason
