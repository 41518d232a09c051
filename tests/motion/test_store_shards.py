"""Shards of a library: named by their bytes, added to, and left whole by a writer that is stopped or killed."""

import hashlib
import multiprocessing
import operator
import shutil
import time
from dataclasses import replace
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.store import (
    Library,
    LibraryWriter,
    map_clips,
    read_library,
    shard,
    work,
    write_library,
    writer,
)


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
