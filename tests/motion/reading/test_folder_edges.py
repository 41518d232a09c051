"""Names from files, links, damaged parts: a folder's good motions are kept, apart, and inside the library."""

from pathlib import Path

import joblib
import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.io.names import LONGEST, require_stem
from bumblebee.motion.reading import ready
from bumblebee.motion.reading.folder import ReadConfig, read_file, read_folder
from bumblebee.motion.reading.walk import motion_files
from bumblebee.motion.resample import resample
from bumblebee.motion.store import LibraryWriter, read_library, write_library
from bumblebee.motion.store.index import read_places
from bumblebee.motion.store.place import path_of

CONFIG = ReadConfig(csv_fps=30)


def test_motions_of_one_pickle_whose_names_come_out_alike_stay_apart(motions, tmp_path):
    fields = motions.fields(motions.raw(20))
    names = ["a/b", "a_b", "A_B", "../../a b", "x" * 500, "x" * 500 + "y", "", "/etc/passwd", "\ud800"]
    joblib.dump(dict.fromkeys(names, fields), tmp_path / "many.pkl")
    clips = read_folder(tmp_path, CONFIG).clips
    assert len({clip.name.casefold() for clip in clips}) == len(names) == len(clips)
    assert all(require_stem("", clip.name) and len(clip.name.encode()) <= LONGEST for clip in clips)
    write_library(tmp_path / "lib", clips)
    assert [clip.name for clip in read_library(tmp_path / "lib")] == [clip.name for clip in clips]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["lib", "many.pkl"]


def test_a_motion_called_like_a_piece_of_another_stays_apart(motions, tmp_path):
    config = ReadConfig(csv_fps=30, max_seconds=0.8)
    motions.csv(motions.raw(61), "walk.csv")
    motions.csv(motions.raw(20), "walk_p0.csv")
    clips = read_folder(tmp_path, config).clips
    assert len(clips) == len({clip.name for clip in clips}) == 4


def test_names_that_differ_in_case_only_stay_apart(motions, tmp_path):
    motions.csv(motions.raw(20), "a/walk.csv")
    motions.csv(motions.raw(20), "b/Walk.csv")
    assert [clip.name for clip in read_folder(tmp_path, CONFIG).clips] == ["walk", "b_Walk"]


def test_a_library_that_was_cut_again_has_no_name_twice(motions, tmp_path):
    write_library(tmp_path / "in/lib", [motions.clip("walk", 80), motions.clip("walk_p0", 30)])
    config = ReadConfig(max_seconds=0.8)
    for clips in (read_folder(tmp_path / "in", config).clips, read_file(tmp_path / "in/lib/index.parquet", config)):
        assert len(clips) == len({clip.name for clip in clips}) == 3


def test_a_damaged_clip_of_a_library_is_listed_and_the_others_are_read(motions, tmp_path):
    write_library(tmp_path / "in/lib", [motions.clip(name, 12) for name in "abc"])
    with LibraryWriter(tmp_path / "in/lib") as writer:  # a shard of its own
        writer.add(motions.clip("d", 12))
    path = path_of(tmp_path / "in/lib", read_places(tmp_path / "in/lib")["shard"][3])
    path.write_bytes(b"PAR1")
    reading = read_folder(tmp_path / "in", CONFIG)
    assert [clip.name for clip in reading.clips] == ["a", "b", "c"]
    assert reading.skipped["file"].tolist() == ["lib/d"]
    assert "expected a readable Parquet file" in reading.skipped["reason"][0]


@pytest.mark.parametrize("name", ["../../escaped", "/tmp/escaped", "a/b", ".hidden", "", "x" * 200, "a\nb"])
def test_no_clip_is_written_outside_its_library(motions, tmp_path, name):
    with pytest.raises(BadInput, match="expected a name"):
        write_library(tmp_path / "a/lib", [motions.clip(name, 12)])
    assert list(tmp_path.rglob("*")) == [tmp_path / "a"]


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e30])
def test_a_clip_that_could_not_be_read_back_is_not_written(motions, tmp_path, value):
    clip = motions.clip("a", 12)
    clip.root_pos[3, 0] = value
    with pytest.raises(BadInput, match="root_pos, row 3: expected finite numbers up to 1000 m"):
        write_library(tmp_path / "lib", [clip])
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_vanishes_meanwhile_is_listed(motions, tmp_path):
    names = [f"m{number:02}" for number in range(12)]  # the first few are read ahead
    for name in names:
        gone = motions.csv(motions.raw(20), f"{name}.csv")  # the last in the end
    reading = read_folder(tmp_path, ReadConfig(csv_fps=30, processes=1), lambda: gone.unlink(missing_ok=True))
    assert [clip.name for clip in reading.clips] == names[:-1]
    assert reading.skipped.to_dict("records") == [{"file": "m11.csv", "reason": "expected a file, came no such file"}]


def test_a_mistake_of_ours_about_one_file_does_not_cost_the_others(motions, tmp_path, monkeypatch):
    for name in ("a.csv", "b.csv"):
        motions.csv(motions.raw(20), name)

    def broken(raw, fps):
        return resample(raw, fps) if raw.name == "b" else [][1]

    monkeypatch.setattr(ready, "resample", broken)
    reading = read_folder(tmp_path, ReadConfig(csv_fps=30, processes=1))
    assert [clip.name for clip in reading.clips] == ["b"]
    assert "IndexError" in reading.skipped["reason"][0]


def test_a_thousand_folders_in_one_another_are_walked(motions, tmp_path, monkeypatch):
    path = motions.csv(motions.raw(20), "a.csv")
    monkeypatch.chdir(tmp_path)
    import os

    for _ in range(1010):  # deeper than Python may call itself
        os.mkdir("d")
        os.chdir("d")
    os.chdir(tmp_path)
    assert motion_files(Path(".")) == [Path("a.csv")] and path.exists()
    for _ in range(1010):
        os.chdir("d")
    for _ in range(1010):
        os.chdir("..")
        os.rmdir("d")


def test_an_hour_and_more_is_refused_before_it_is_resampled(motions, tmp_path):
    raw = motions.raw(20)
    values = {f: np.repeat(v, 200, axis=0) for f, v in motions.fields(raw).items() if f != "fps"}
    joblib.dump({"long": {**values, "fps": 1}}, tmp_path / "a.pkl")
    with pytest.raises(BadInput, match="at most 3600 s, came 3999 s"):
        read_file(tmp_path / "a.pkl", CONFIG)


def test_an_array_made_again_and_again_is_counted_each_time(tmp_path, monkeypatch):
    from bumblebee.motion.formats import safe_pickle

    monkeypatch.setattr(safe_pickle, "MAX_BYTES", 100_000)
    call = b"cnumpy.core.numeric\n_frombuffer\n"
    args = b"(B" + (8000).to_bytes(4, "little") + bytes(8000) + b"cnumpy\ndtype\n\x8c\x02f8\x85RM\xe8\x03\x85\x8c\x01Ct"
    again = b"0h\x00h\x01R"
    (tmp_path / "a.pkl").write_bytes(b"\x80\x04" + call + b"\x94" + args + b"\x94R" + again * 50 + b".")
    with pytest.raises(BadInput, match="arrays of more than"):
        safe_pickle.load(tmp_path / "a.pkl")
    (tmp_path / "b.pkl").write_bytes(b"\x80\x04" + call + b"\x94" + args + b"\x94R" + again * 5 + b".")
    assert safe_pickle.load(tmp_path / "b.pkl").shape == (1000,)
