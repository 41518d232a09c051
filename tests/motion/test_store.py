"""A library comes back as it was written, and appears whole or not at all."""

import errno
import hashlib
import multiprocessing
import operator
import shutil
import time
import tracemalloc
from dataclasses import replace
from pathlib import Path

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
    map_clips,
    read_index,
    read_library,
    shard,
    work,
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


def many(motions, count: int, frames: int = 12) -> list:
    """Clips that share their arrays, of distinct names and sources."""
    clip = motions.clip("m", frames)
    return [replace(clip, name=f"m{number:04d}", sha256=f"{number:064x}") for number in range(count)]


def shards(folder) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in (folder / "clips").iterdir()}


@pytest.fixture
def small_shards(monkeypatch):
    """Shards of 4 to 12 clips, two or three to a row group, so that a few clips fill several."""
    monkeypatch.setattr(writer, "LEAST_CLIPS", 4)
    monkeypatch.setattr(writer, "MOST_CLIPS", 12)
    monkeypatch.setattr(writer, "ends", lambda name: int(name[1:]) % 7 == 3)
    monkeypatch.setattr(shard, "GROUP_CLIPS", 3)
    monkeypatch.setattr(shard, "GROUP_FRAMES", 30)


def test_equal_clips_give_equal_bytes_and_shards_are_named_by_them(motions, tmp_path, small_shards):
    for name in ("one", "other"):
        write_library(tmp_path / name, many(motions, 40))
    assert shards(tmp_path / "one") == shards(tmp_path / "other") and len(shards(tmp_path / "one")) > 4
    for name, data in shards(tmp_path / "one").items():
        assert name == f"{hashlib.sha256(data).hexdigest()[:32]}.parquet"
    assert (tmp_path / "one/index.parquet").read_bytes() == (tmp_path / "other/index.parquet").read_bytes()


@pytest.mark.parametrize("change", ["one more", "one less", "another source"])
def test_a_changed_motion_changes_its_shard_and_no_other(motions, tmp_path, small_shards, change):
    clips = many(motions, 60)
    write_library(tmp_path / "lib", clips)
    before = shards(tmp_path / "lib")
    if change == "another source":
        clips[20] = replace(clips[20], sha256="f" * 64)
    elif change == "one more":
        clips.insert(20, replace(clips[20], name="m9999"))
    else:
        del clips[20]
    write_library(tmp_path / "lib", clips)
    after = shards(tmp_path / "lib")
    assert len(after.keys() - before.keys()) == 1 and len(before.keys() - after.keys()) == 1


def test_a_library_is_read_lazily_by_name_and_in_order(motions, tmp_path, small_shards):
    clips = many(motions, 30)
    write_library(tmp_path / "lib", clips)
    library = Library(tmp_path / "lib")
    assert len(library) == 30 and "m0007" in library and "m0030" not in library
    assert library.names == [clip.name for clip in library] == [clip.name for clip in clips]
    assert library["m0007"].sha256 == clips[7].sha256
    assert [clip.name for clip in library.select(["m0029", "m0000", "m0029"])] == ["m0029", "m0000", "m0029"]
    assert library.index["sha256"].tolist() == [clip.sha256 for clip in clips]
    with pytest.raises(BadInput, match="'m0030'"):
        library["m0030"]


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


def test_appending_leaves_the_shards_that_are_there(motions, tmp_path, small_shards):
    clips = many(motions, 40)
    write_library(tmp_path / "lib", clips[:30])
    before = shards(tmp_path / "lib")
    with LibraryWriter(tmp_path / "lib") as added:
        assert added.has("m0029", clips[29].sha256)
        assert not added.has("m0029", "another") and not added.has("m0030", clips[30].sha256)
        for clip in clips[30:]:
            added.add(clip)
    assert before.items() <= shards(tmp_path / "lib").items()
    assert [clip.name for clip in read_library(tmp_path / "lib")] == [clip.name for clip in clips]


def test_a_motion_of_a_known_name_takes_the_others_place(motions, tmp_path, small_shards):
    clips = many(motions, 30)
    write_library(tmp_path / "lib", clips)
    before = shards(tmp_path / "lib")
    with LibraryWriter(tmp_path / "lib") as added:
        added.add(replace(clips[9], sha256="new"))
    after = shards(tmp_path / "lib")
    assert len(before.keys() - after.keys()) == 1
    library = Library(tmp_path / "lib")
    assert library.names == [clip.name for clip in clips] and library["m0009"].sha256 == "new"
    held = [facts["name"] for name in after for facts in shard.Shard(tmp_path / "lib/clips" / name).facts]
    assert sorted(held) == sorted(clip.name for clip in clips)  # the old one is nowhere


def test_a_writer_that_was_stopped_leaves_the_old_library_and_its_shards_to_the_next(motions, tmp_path, small_shards):
    clips = many(motions, 40)
    write_library(tmp_path / "lib", clips[:10])
    with pytest.raises(KeyboardInterrupt), LibraryWriter(tmp_path / "lib") as added:
        for clip in clips[10:]:
            if clip.name == "m0035":
                raise KeyboardInterrupt
            added.add(clip)
    assert [clip.name for clip in read_library(tmp_path / "lib")] == [clip.name for clip in clips[:10]]
    (tmp_path / "lib/clips/.x.parquet.1.part").write_bytes(b"PAR1")  # what a kill leaves beside
    with LibraryWriter(tmp_path / "lib") as added:
        there = [clip.name for clip in clips if added.has(clip.name, clip.sha256)]
        assert len(there) > 25 and there == [clip.name for clip in clips[: len(there)]]
        for clip in clips[len(there) :]:
            added.add(clip)
    assert [clip.name for clip in read_library(tmp_path / "lib")] == [clip.name for clip in clips]
    write_library(tmp_path / "whole", clips[10:])
    assert shards(tmp_path / "whole").items() <= shards(tmp_path / "lib").items()  # as if nothing had been


def test_a_damaged_row_group_costs_its_own_clips(motions, tmp_path, small_shards):
    write_library(tmp_path / "lib", many(motions, 4))
    (path,) = (tmp_path / "lib/clips").iterdir()
    data = bytearray(path.read_bytes())
    data[60] ^= 1  # in the first page: zstd may not notice, the checksum does
    path.write_bytes(data)
    clips = dict(Library(tmp_path / "lib").each())
    damaged = [name for name, clip in clips.items() if isinstance(clip, BadInput)]
    assert damaged == ["m0000", "m0001"] and clips["m0003"].name == "m0003"
    assert "\n" not in str(clips["m0000"]) and str(path) in str(clips["m0000"])
    with pytest.raises(BadInput):
        read_library(tmp_path / "lib")


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


def test_work_in_processes_comes_in_order_and_as_in_one(motions, tmp_path, monkeypatch):
    monkeypatch.setattr(work, "BATCH", 8)
    write_library(tmp_path / "lib", many(motions, 40))
    name = operator.attrgetter("name")
    alone = list(map_clips(tmp_path / "lib", name, processes=1))
    assert list(map_clips(tmp_path / "lib", name, processes=2)) == alone == [f"m{n:04d}" for n in range(40)]


def _add_until_killed(folder: Path, clips: list) -> None:
    with LibraryWriter(folder) as added:
        for clip in clips:
            added.add(clip)
            time.sleep(0.002)


def test_a_process_that_is_killed_while_it_adds_costs_one_shard_at_most(motions, tmp_path):
    clips = many(motions, 2000)
    write_library(tmp_path / "lib", clips[:3])
    before = len(shards(tmp_path / "lib"))
    adding = multiprocessing.get_context("spawn").Process(target=_add_until_killed, args=(tmp_path / "lib", clips[3:]))
    adding.start()
    end = time.monotonic() + 60
    while len(list((tmp_path / "lib/clips").glob("[0-9a-f]*"))) < before + 2 and time.monotonic() < end:
        time.sleep(0.01)
    adding.kill()
    adding.join()
    assert [clip.name for clip in read_library(tmp_path / "lib")] == ["m0000", "m0001", "m0002"]
    with LibraryWriter(tmp_path / "lib") as added:
        there = sum(added.has(clip.name, clip.sha256) for clip in clips)
        assert there >= 3 + 2 * shard.LEAST_CLIPS
        for clip in clips[there : there + 5]:
            assert not added.has(clip.name, clip.sha256)
            added.add(clip)
    assert Library(tmp_path / "lib").names == [clip.name for clip in clips[: there + 5]]
    assert not [path for path in (tmp_path / "lib/clips").iterdir() if path.name.startswith(".")]


def test_what_a_killed_process_left_is_cleared_and_a_library_that_it_moved_away_comes_back(motions, tmp_path):
    write_library(tmp_path / "lib", [motions.clip("old", 12)])
    gone = 2**22 + 1  # beyond all process numbers
    (tmp_path / "lib").rename(tmp_path / f".lib.{gone}.old")
    (tmp_path / f".lib.{gone}.abc.part").mkdir()
    with pytest.raises(BadInput):  # one that fails puts back what the other had moved away
        write_library(tmp_path / "lib", [motions.clip("", 12)])
    assert [clip.name for clip in read_library(tmp_path / "lib")] == ["old"]
    assert [path.name for path in tmp_path.iterdir()] == ["lib"]


def test_a_writer_that_was_killed_before_it_removed_the_old_shards_brings_no_old_motion_back(motions, tmp_path):
    clips = many(motions, 3)
    write_library(tmp_path / "lib", clips)
    (old,) = (tmp_path / "lib/clips").iterdir()
    kept = Path(shutil.copy2(old, tmp_path / "kept"))
    time.sleep(0.02)  # beyond the clock of any file system here
    with LibraryWriter(tmp_path / "lib") as added:
        added.add(replace(clips[1], sha256="new"))
    shutil.copy2(kept, old)
    with LibraryWriter(tmp_path / "lib") as added:
        assert added.has("m0001", "new") and added.has("m0002", clips[2].sha256)
    assert Library(tmp_path / "lib")["m0001"].sha256 == "new" and not old.exists()
