"""Outputs appear whole, replace no input and nothing that is not ours, and a disk is tried before the work."""

import os
import tempfile
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.io import write


def test_an_output_is_no_input_and_holds_none(tmp_path: Path):
    data = tmp_path / "ds"
    data.mkdir()
    (tmp_path / "link").symlink_to(data)
    for out in (data, tmp_path, tmp_path / "link", data / "x" / ".."):
        with pytest.raises(BadInput, match="does not contain the input"):
            write.refuse_overlap(out, [data])
    for out in (data / "found", tmp_path / "link" / "found"):
        write.refuse_overlap(out, [data])
        with pytest.raises(BadInput, match="outside the input"):
            write.refuse_entering(out, [data])
    write.refuse_entering(tmp_path / "ds2", [data])
    write.refuse_overlap(tmp_path / "ds2", [data])


def test_a_hard_link_of_an_input_is_that_input(tmp_path: Path):
    (tmp_path / "a").write_text("x")
    os.link(tmp_path / "a", tmp_path / "b")
    with pytest.raises(BadInput):
        write.refuse_overlap(tmp_path / "b", [tmp_path / "a"])


def test_what_is_not_ours_is_not_replaced(tmp_path: Path):
    (tmp_path / "a").write_text("theirs")
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    for name in ("a", "dangling"):
        with pytest.raises(BadInput):
            write.refuse_foreign(tmp_path / name, lambda path: False, "a file of errors")
    write.refuse_foreign(tmp_path / "new", lambda path: False, "a file of errors")
    write.refuse_foreign(tmp_path / "a", lambda path: True, "a file of errors")


def test_what_replaces_nothing_says_so(tmp_path: Path):
    (tmp_path / "a").mkdir()
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    for name in ("a", "dangling"):
        with pytest.raises(BadInput, match=r"came one that exists\. Nothing is replaced.*remove it first"):
            write.refuse_existing(tmp_path / name)
    write.refuse_existing(tmp_path / "new")


def test_trying_an_output_leaves_nothing(tmp_path: Path):
    write.try_output(tmp_path / "a" / "b" / "out")
    assert list(tmp_path.iterdir()) == []


def test_an_output_under_a_file_is_refused_at_once(tmp_path: Path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(BadInput, match="file"):
        write.try_output(tmp_path / "file" / "out")


def test_a_folder_appears_whole_or_not_at_all(tmp_path: Path):
    out = tmp_path / "out"
    with pytest.raises(RuntimeError), write.new_folder(out) as folder:
        (folder / "half").write_text("x")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []
    for text in ("one", "two"):
        with write.new_folder(out) as folder:
            (folder / "whole").write_text(text)
    assert (out / "whole").read_text() == "two"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_finished_result_is_kept_where_its_place_is_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def refuse(fresh: Path, out: Path) -> None:
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(write, "swap", refuse)
    with pytest.raises(BadInput, match="complete and kept in") as caught, write.new_folder(tmp_path / "out") as folder:
        (folder / "whole").write_text("x")
    kept = Path(str(caught.value).split("kept in ")[1].rstrip("."))
    assert (kept / "whole").read_text() == "x"


GONE = 2**22 + 7  # no process has this number: Linux ends at 2^22


def test_what_a_killed_run_left_is_cleared_and_what_a_living_one_works_on_stays(tmp_path: Path):
    for process in (GONE, os.getppid()):
        (tmp_path / f".out.{process}.abc_1.part").mkdir()
        (tmp_path / f".out.{process}.abc_2.part").write_text("half")
    (tmp_path / f".other.{GONE}.abc_1.part").mkdir()
    (tmp_path / f".out.{GONE}.mine").mkdir()
    write.try_output(tmp_path / "out")
    kept = {path.name for path in tmp_path.iterdir()}
    living = {f".out.{os.getppid()}.abc_{n}.part" for n in (1, 2)}
    assert kept == {*living, f".other.{GONE}.abc_1.part", f".out.{GONE}.mine"}


def test_a_result_that_a_killed_run_had_moved_away_comes_back(tmp_path: Path):
    (tmp_path / f".out.{GONE}.old").mkdir()
    (tmp_path / f".out.{GONE}.old" / "result").write_text("mine")
    write.try_output(tmp_path / "out")
    assert (tmp_path / "out" / "result").read_text() == "mine"
    (tmp_path / f".out.{GONE}.old").mkdir()
    write.try_output(tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_an_interrupted_exchange_leaves_the_old_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    write.write_folder(tmp_path / "out", {"a": "old"})
    real = os.rename

    def rename(source: Path, target: Path) -> None:
        if str(source).endswith(".part"):
            raise KeyboardInterrupt
        real(source, target)

    monkeypatch.setattr(os, "rename", rename)
    with pytest.raises(KeyboardInterrupt):
        write.write_folder(tmp_path / "out", {"a": "new"})
    assert (tmp_path / "out" / "a").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_files_that_their_disk_does_not_take_are_kept_elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "elsewhere"))
    real = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        if "elsewhere" in path.parts:
            return real(path, data)
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(BadInput, match="No space left") as caught:
        write.write_folder(tmp_path / "out", {"a": "x"})
    kept = Path(str(caught.value).split("kept in ")[1].rstrip("."))
    assert (kept / "a").read_text() == "x"
    assert [path.name for path in tmp_path.iterdir()] == ["elsewhere"]


def test_a_result_that_no_disk_takes_is_said_to_be_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    assert "lost" in write.kept("out", {"a": "x"})


def test_long_names_have_temporary_names_that_a_disk_takes(tmp_path: Path):
    out = tmp_path / ("ü" * 120)
    write.write_folder(out, {"a": "x"})
    write.write_file(tmp_path / ("n" * 250), "x")
    assert (out / "a").read_text() == "x"
