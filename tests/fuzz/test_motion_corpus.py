"""Each bad motion file of the corpus is listed with a reason, each bad library refused in one line."""

import resource
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.reading.folder import ReadConfig, read_folder
from bumblebee.motion.store import read_library
from tests.fuzz.corpora.library_corpus import LIBRARIES
from tests.fuzz.corpora.motion_corpus import CAPTIONS, FILES
from tests.fuzz.motion_files import csv, library, table

CONFIG = ReadConfig(csv_fps=30, joints_23="asap")
ROOM = 3 << 30  # bytes of address space beyond what the process has: a bomb ends in MemoryError, not in a dead machine


@pytest.fixture(autouse=True)
def bounded_memory() -> Iterator[None]:
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text().split()[0]) if Path("/proc/self/statm").exists() else 0
    if pages:
        resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + ROOM, hard))
    yield
    resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def files_below(folder: Path) -> set[Path]:
    return {path for path in folder.rglob("*") if not path.is_symlink()}


@pytest.mark.parametrize("name", FILES)
def test_a_bad_file_is_listed_with_its_reason_and_stops_no_other(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "motions"
    folder.mkdir()
    (folder / "good.csv").write_text(csv(table()))
    FILES[name](folder)
    before = files_below(tmp_path)
    reading = read_folder(folder, CONFIG)
    assert [clip.name for clip in reading.clips] == ["good"]
    (row,) = reading.skipped.to_dict("records")
    assert row["file"].startswith("bad") and row["file"].isprintable()
    assert row["reason"] and row["reason"].isprintable() and len(row["reason"]) < 600
    assert "please report" not in row["reason"]
    assert files_below(tmp_path) == before and not Path("executed").exists()
    assert all(np.isfinite(clip.root_pos).all() for clip in reading.clips)
    reading.skipped.to_csv(tmp_path / "skipped.csv")


@pytest.mark.parametrize("name", CAPTIONS)
def test_a_bad_text_is_noted_and_costs_its_motion_the_captions_alone(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "motions"
    folder.mkdir()
    CAPTIONS[name](folder)
    before = files_below(tmp_path)
    reading = read_folder(folder, CONFIG)
    assert [(clip.name, clip.captions, clip.caption_source) for clip in reading.clips] == [("bad", (), "")]
    assert reading.skipped.empty and files_below(tmp_path) == before
    notes = [note for note in reading.notes["note"] if "bad.txt" in note]
    assert len(notes) == 1 and notes[0].isprintable() and len(notes[0]) < 600
    assert reading.texts is not None and reading.texts.motions == {"none": 1}


@pytest.mark.parametrize("name", LIBRARIES)
def test_a_bad_library_is_refused_in_one_line(tmp_path: Path, name: str) -> None:
    folder = library(tmp_path / "a/b/lib")
    LIBRARIES[name](folder)
    before = files_below(tmp_path)
    with pytest.raises(BadInput) as caught:
        read_library(folder)
    assert str(caught.value).isprintable() and len(str(caught.value)) < 800
    assert str(folder) in str(caught.value)
    assert files_below(tmp_path) == before
