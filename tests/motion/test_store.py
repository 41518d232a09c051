"""A library comes back as it was written, and appears whole or not at all."""

import errno
import tracemalloc
from dataclasses import replace

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.store import (
    INDEX_COLUMNS,
    Library,
    LibraryWriter,
    index_of,
    read_index,
    read_library,
    write_clip,
    write_library,
    writer,
)


def test_round_trip_keeps_every_byte_and_fact(motions, tmp_path):
    about = {
        "captions": ("a person sways.#a/DET#0.0#0.0",),
        "family": "stand",
        "split": "test",
        "caption_source": "file",
    }
    clips = [motions.clip("b", 40, source="x.pkl", licence="MIT", sha256="ff", **about), motions.clip("a", 20)]
    write_library(tmp_path / "lib", clips, pd.DataFrame({"file": ["c.npz"], "reason": ["SMPL"]}))
    for wrote, came in zip(clips, read_library(tmp_path / "lib"), strict=True):
        for name, value in vars(wrote).items():
            np.testing.assert_array_equal(getattr(came, name), value)
    index = read_index(tmp_path / "lib")
    assert list(index.columns) == list(INDEX_COLUMNS)
    assert list(index["name"]) == ["b", "a"]
    assert list(index["captions"][0]) == list(about["captions"])
    assert index["frames"].tolist() == [40, 20]
    assert pd.read_csv(tmp_path / "lib/skipped.csv").to_dict("records") == [{"file": "c.npz", "reason": "SMPL"}]


def test_named_clips_come_in_the_order_asked_for(motions, tmp_path):
    write_library(tmp_path / "lib", [motions.clip(name, 12) for name in "abc"])
    assert [clip.name for clip in read_library(tmp_path / "lib", ["c", "a"])] == ["c", "a"]
    with pytest.raises(BadInput, match="'d'"):
        read_library(tmp_path / "lib", ["d"])


def test_a_full_disk_leaves_the_old_library_and_no_rubbish(motions, tmp_path, monkeypatch):
    write_library(tmp_path / "lib", [motions.clip("old", 12)])
    put, written = writer.put, []

    def full(path, data):
        if written:
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        written.append(path)
        put(path, data)

    monkeypatch.setattr(writer, "put", full)
    monkeypatch.setattr(writer, "MOST_CLIPS", 1)
    with pytest.raises(BadInput, match="No space left on device") as caught:
        write_library(tmp_path / "lib", [motions.clip("n1", 12), motions.clip("n2", 12)])
    assert "\n" not in str(caught.value)
    assert [clip.name for clip in read_library(tmp_path / "lib")] == ["old"]
    assert [path.name for path in tmp_path.iterdir()] == ["lib"]


def test_a_failure_between_clips_leaves_nothing(motions, tmp_path):
    with pytest.raises(BadInput, match="two clips named 'a'"):
        write_library(tmp_path / "lib", [motions.clip("a", 12), motions.clip("a", 12)])
    assert list(tmp_path.iterdir()) == []


def test_a_place_that_cannot_be_written_gives_one_line(motions, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BadInput, match="file/lib: expected a folder that can be written"):
        write_library(tmp_path / "file" / "lib", [motions.clip("a", 12)])


@pytest.mark.parametrize("content", [b"", b"PAR1 rubbish PAR1", None])
def test_a_shard_that_is_no_parquet_is_named(motions, tmp_path, content):
    write_library(tmp_path / "lib", [motions.clip("a", 12)])
    (path,) = (tmp_path / "lib/clips").iterdir()
    path.unlink()
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(BadInput, match=path.name):
        read_library(tmp_path / "lib")


def test_a_folder_without_index_is_named(tmp_path):
    with pytest.raises(BadInput, match="index of a motion library, came no such file"):
        read_library(tmp_path)


@pytest.mark.parametrize(
    "notes", [b"\xb1", b"{", b"[]", b'{"index_columns": ["x"], "columns": [], "column_indexes": 3}']
)
def test_damaged_notes_for_pandas_in_an_index_change_nothing(motions, tmp_path, notes):
    write_library(tmp_path / "lib", [motions.clip("a", 12)])
    path = tmp_path / "lib/index.parquet"
    wanted = read_index(tmp_path / "lib")
    pq.write_table(pq.read_table(path).replace_schema_metadata({b"pandas": notes}), path)
    pd.testing.assert_frame_equal(read_index(tmp_path / "lib"), wanted)


def test_no_more_than_some_clips_are_in_memory(motions, tmp_path):
    """A library of 44 MB, while it is written from a stream and while it is gone through."""
    one = motions.clip("m", 400)

    def stream():
        for number in range(400):
            copies = {name: getattr(one, name).copy() for name in ("root_pos", "root_quat", "joint_pos", "key_pos")}
            yield replace(one, name=f"m{number:04d}", **copies)

    tracemalloc.start()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(writer, "MOST_CLIPS", 32)
        patch.setattr(writer, "LEAST_CLIPS", 32)
        write_library(tmp_path / "lib", stream())
    written = tracemalloc.get_traced_memory()[1]
    tracemalloc.reset_peak()
    assert sum(clip.frames for clip in Library(tmp_path / "lib")) == 160_000
    read = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert written < 25e6 and read < 15e6


def test_a_clip_of_wrong_values_costs_itself(motions, tmp_path, monkeypatch):
    good, bad = motions.clip("good", 12), motions.clip("bad", 12)
    bad.key_pos[0] += 1
    monkeypatch.setattr(writer, "check_clips", lambda _: None)
    write_library(tmp_path / "lib", [good, bad])
    clips = dict(Library(tmp_path / "lib").each())
    assert clips["good"].name == "good" and "bad: key_pos" in str(clips["bad"])


def test_a_library_from_before_shards_is_still_read_and_not_added_to(motions, tmp_path):
    clips = [motions.clip(name, 12) for name in "ab"]
    (tmp_path / "lib/clips").mkdir(parents=True)
    for clip in clips:
        write_clip(tmp_path / f"lib/clips/{clip.name}.parquet", clip)
    index_of(clips).to_parquet(tmp_path / "lib/index.parquet", index=False)
    for wrote, came in zip(clips, read_library(tmp_path / "lib"), strict=True):
        np.testing.assert_array_equal(came.key_pos, wrote.key_pos)
    with pytest.raises(BadInput, match="Write it anew"):
        LibraryWriter(tmp_path / "lib")


def test_what_a_killed_process_left_is_cleared_and_a_library_that_it_moved_away_comes_back(motions, tmp_path):
    write_library(tmp_path / "lib", [motions.clip("old", 12)])
    gone = 2**22 + 1  # beyond all process numbers
    (tmp_path / "lib").rename(tmp_path / f".lib.{gone}.old")
    (tmp_path / f".lib.{gone}.abc.part").mkdir()
    with pytest.raises(BadInput):  # one that fails puts back what the other had moved away
        write_library(tmp_path / "lib", [motions.clip("", 12)])
    assert [clip.name for clip in read_library(tmp_path / "lib")] == ["old"]
    assert [path.name for path in tmp_path.iterdir()] == ["lib"]
