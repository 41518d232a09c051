"""A folder of people and robots in every format and in archives: all of it is read, the rest listed, the cache used."""

import zipfile
from dataclasses import fields, replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import bumblebee as bb
from bumblebee.api import training as api_training
from bumblebee.commands import train as cli_train
from bumblebee.motion.cache import VARIABLE
from bumblebee.motion.clip import Clip
from bumblebee.motion.describe.describer import DescribeConfig
from bumblebee.motion.reading import ready
from bumblebee.motion.reading.folder import Reading, read_each, read_folder
from bumblebee.motion.reading.settings import ReadConfig
from bumblebee.motion.retarget.config import RetargetConfig
from tests.motion.describe.small_humanml3d import put_humanml3d
from tests.motion.human.people import bvh, npz, smpl

CONFIG = ReadConfig(csv_fps=30, processes=1)
INDEX = """source_path,start_frame,end_frame,new_name
./pose_data/CMU/01/01_01_poses.npy,0,10,000000.npy
./pose_data/CMU/01/01_02_poses.npy,0,10,000001.npy
"""
TEXTS = {
    f"00000{n}": f"a person {word}#a/DET person/NOUN {word}/VERB#0.0#0.0\n" for n, word in enumerate(["sways", "x"])
}


@pytest.fixture
def mixed(motions, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Ten good motions, one bad member of an archive, one bad file."""
    monkeypatch.delenv("SMPL_MODEL_DIR", raising=False)
    folder = tmp_path / "mine"
    for number in range(4):
        motions.csv(motions.raw(20, yaw=number / 10), f"mine/robot/sway{number}.csv")
    motions.pickle(motions.raw(20), "mine/robot/kick.pkl")
    (folder / "robot/LICENSE").write_text("Apache License")
    (folder / "cmu").mkdir()
    (folder / "cmu/01_01.bvh").write_text(bvh(90))
    (folder / "cmu/walk.npz").write_bytes(npz(smpl(60)))
    (folder / "cmu/LICENSE").write_text("MIT License")
    (folder / "bad.bvh").write_text("HIERARCHY\n")
    with zipfile.ZipFile(folder / "more.zip", "w") as archive:
        archive.writestr("LICENSE", "Creative Commons Attribution-NonCommercial")
        archive.writestr("kit/walk.npz", npz(smpl(50)))
        archive.writestr("kit/walk.bvh", bvh(50))
        archive.writestr("kit/broken.bvh", bvh(50).replace("Frames: 50", "Frames: 60"))
        archive.writestr("kit/jump.bvh", bvh(40))
    return folder


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the motions that were retargeted and not taken from the cache."""
    names: list[str] = []
    before = ready.retarget

    def counted(motion, *rest):
        names.append(motion.name)
        return before(motion, *rest)

    monkeypatch.setattr(ready, "retarget", counted)
    return names


def by_name(reading: Reading) -> dict[str, Clip]:
    return {clip.name: clip for clip in reading.clips}


def assert_same(one: Reading, other: Reading) -> None:
    assert [clip.name for clip in one.clips] == [clip.name for clip in other.clips]
    for first, second in zip(one.clips, other.clips, strict=True):
        for field in fields(Clip):
            ours, theirs = getattr(first, field.name), getattr(second, field.name)
            assert np.array_equal(ours, theirs) if isinstance(ours, np.ndarray) else ours == theirs, field.name
    assert one.skipped.equals(other.skipped) and one.notes.equals(other.notes) and one.texts == other.texts


def test_every_format_is_read_under_a_name_of_its_own(mixed):
    reading = read_folder(mixed, CONFIG)
    names = {"sway0", "sway1", "sway2", "sway3", "kick", "01_01", "walk", "kit_walk", "cmu_walk", "jump"}
    assert set(by_name(reading)) == names and len(reading.clips) == len(names)
    assert all(clip.fps == 50.0 and clip.joint_pos.shape[1] == 23 for clip in reading.clips)
    assert by_name(reading)["01_01"].frames == 38 and by_name(reading)["jump"].family == "jump"


def test_a_bad_member_and_a_bad_file_are_listed_and_cost_no_other(mixed):
    skipped = read_folder(mixed, CONFIG).skipped
    assert sorted(skipped["file"]) == ["bad.bvh", "more.zip/kit/broken.bvh"]
    assert all("expected" in reason and reason.isprintable() for reason in skipped["reason"])


def test_each_motion_has_the_licence_of_its_own_folder_or_archive(mixed):
    clips = by_name(read_folder(mixed, CONFIG))
    said = {name: clips[name].licence for name in ("sway0", "kick", "cmu_walk", "01_01", "walk", "jump")}
    assert said == {"sway0": "Apache-2.0", "kick": "Apache-2.0", "cmu_walk": "MIT", "01_01": "MIT",
                    "walk": "CC-BY-NC-4.0", "jump": "CC-BY-NC-4.0"}  # fmt: skip
    assert clips["jump"].source == "kit/jump.bvh"


def test_humanml3ds_texts_are_joined_by_the_path_and_the_others_have_none(mixed, tmp_path):
    folder = put_humanml3d(tmp_path / "humanml3d", INDEX, TEXTS)
    reading = read_folder(mixed, replace(CONFIG, describe=DescribeConfig(humanml3d=str(folder))))
    clip = by_name(reading)["01_01"]
    assert clip.caption_source == "humanml3d" and [line.split("#")[0] for line in clip.captions] == ["a person sways"]
    assert all(other.captions == () for other in reading.clips if other is not clip)
    assert reading.texts is not None and reading.texts.motions == {"humanml3d": 1, "none": 9}


def test_what_was_detected_is_noted_beside_its_file(mixed):
    notes = read_folder(mixed, CONFIG).notes
    assert {"cmu/01_01.bvh", "cmu/walk.npz", "more.zip/kit/jump.bvh"} <= set(notes["file"])
    assert any("mean SMPL" in note for note in notes.loc[notes["file"] == "cmu/walk.npz", "note"])


def test_a_second_read_makes_nothing_anew_and_gives_the_same(mixed, tmp_path, made):
    without = read_folder(mixed, CONFIG)
    made.clear()
    first = read_folder(mixed, CONFIG, cache=tmp_path / "cache")
    assert sorted(made) == ["01_01", "jump", "walk", "walk", "walk"]
    made.clear()
    second = read_folder(mixed, CONFIG, cache=tmp_path / "cache")
    assert made == []
    assert_same(first, second)
    assert_same(first, without)


def test_a_second_training_on_a_folder_retargets_nothing(mixed, tmp_path, made, monkeypatch):
    """Nor does a call from Python on the same files; without the user's cache both would."""
    trained = []
    monkeypatch.setattr(api_training, "train", lambda clips, *_, **__: trained.append(clips) or stop())
    monkeypatch.setattr("bumblebee.motion.reading.folder.ReadConfig", partial(ReadConfig, processes=1))
    for cache, again in ((str(tmp_path / "cache"), 0), ("", 2)):
        monkeypatch.setenv(VARIABLE, cache)
        for _ in range(2):
            made.clear()
            with pytest.raises(KeyboardInterrupt):
                cli_train.train(mixed / "cmu", tmp_path / "policy")
        assert len(made) == again
        bb.read_motions(mixed / "cmu", processes=1, max_seconds=10.0)
        assert len(made) == 2 * again
    assert all(len(clips) == 2 for clips in trained)


def stop():
    raise KeyboardInterrupt


def test_a_changed_neighbour_is_made_anew_alone(mixed, tmp_path, made):
    read_folder(mixed, CONFIG, cache=tmp_path / "cache")
    made.clear()
    (mixed / "cmu/01_01.bvh").write_text(bvh(91))
    (mixed / "cmu/new.bvh").write_text(bvh(80))
    reading = read_folder(mixed, CONFIG, cache=tmp_path / "cache")
    assert sorted(made) == ["01_01", "new"] and len(reading.clips) == 11


def test_a_changed_setting_makes_all_anew(mixed, tmp_path, made):
    read_folder(mixed, CONFIG, cache=tmp_path / "cache")
    before = sorted(made)
    made.clear()
    read_folder(mixed, replace(CONFIG, retarget=RetargetConfig(cutoff=6.0)), cache=tmp_path / "cache")
    assert sorted(made) == before and len(made) == 5


@pytest.mark.slow
def test_the_result_does_not_depend_on_the_number_of_processes(mixed, tmp_path):
    one = read_folder(mixed, CONFIG)
    assert_same(one, read_folder(mixed, replace(CONFIG, processes=2)))
    assert_same(one, read_folder(mixed, replace(CONFIG, processes=2), cache=tmp_path / "cache"))


def test_clips_that_are_taken_one_by_one_are_those_of_the_whole(mixed):
    taken: list[Clip] = []
    reading = read_each(mixed, taken.append, CONFIG)
    assert reading.clips == []
    assert_same(replace(reading, clips=taken), read_folder(mixed, CONFIG))
