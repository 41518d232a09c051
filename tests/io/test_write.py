"""Outputs appear whole, replace no input and nothing that is not ours, and a disk is tried before the work."""

import os
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.io import write


def test_an_output_is_no_input_and_holds_none(tmp_path: Path):
    data = tmp_path / "ds"
    data.mkdir()
    (tmp_path / "link").symlink_to(data)
    for out in (data, tmp_path, tmp_path / "link", data / "x" / ".."):
        with pytest.raises(BadInput, match="apart"):
            write.refuse_overlap(out, [data])
    write.refuse_overlap(data / "found", [data])
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
