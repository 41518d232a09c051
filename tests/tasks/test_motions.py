"""The stage `motions`: a folder or the embedded library becomes data/motions, or nothing does."""

import errno
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bumblebee.errors import BadInput
from bumblebee.motion.reading.folder import Reading, noted_table, skipped_table
from bumblebee.motion.store import read_index, read_library, writer
from bumblebee.robot.facts import stand_pose
from tasks import motions
from tasks.running.stage import run_stage


@pytest.fixture(autouse=True)
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DVC_STAGE", raising=False)
    monkeypatch.setattr(motions, "log_run", lambda *_, **__: None)
    return tmp_path


def params(text: str) -> None:
    Path("params.yaml").write_text(text)


def user_files(count: int = 6, frames: int = 40) -> None:
    """A user's folder of standing motions in the 23-joint layout, and a file of another kind."""
    Path("mine").mkdir(exist_ok=True)
    for number in range(count):
        row = [0.0, 0.0, 0.78, 0.0, 0.0, 0.0, 1.0, *stand_pose()]
        np.savetxt(f"mine/walk{number}.csv", np.tile(row, (frames, 1)), delimiter=",")
    Path("mine/other.npz").write_bytes(b"x")


def ends_with(code: int, capsys: pytest.CaptureFixture[str]) -> str:
    with pytest.raises(SystemExit) as caught:
        run_stage(motions.main, [])
    assert caught.value.code == code
    line = capsys.readouterr().err.strip()
    assert len(line.splitlines()) == 1
    return line


def test_a_folder_becomes_a_library_with_held_out_motions(capsys):
    user_files()
    params("motions: {source: mine, holdout_share: 0.2, read: {csv_fps: 30, joints_23: asap, quaternion: xyzw}}")
    run_stage(motions.main, [])
    index = read_index(Path("data/motions"))
    assert sorted(index["name"]) == [f"walk{number}" for number in range(6)]
    assert set(index["split"]) == {"train", "test"}
    assert pd.read_csv("data/motions/skipped.csv")["file"].tolist() == ["other.npz"]
    out = capsys.readouterr().out
    assert "6 clips" in out and "  mine: 6 clips, 0.1 minutes, licence unknown\n" in out
    assert (
        "motions with text: none 6\n" in out and "skipped: expected a whole .npz file" in out and ": other.npz\n" in out
    )
    assert list(Path(".scratch").rglob("*.parquet")) == []


def test_the_embedded_library_is_written_the_same_twice():
    params("motions: {source: embedded, embedded: {limit: 3}}")
    run_stage(motions.main, [])
    first = {path.name: path.read_bytes() for path in Path("data/motions/clips").iterdir()}
    run_stage(motions.main, [])
    assert len(first) == 1 and len(read_index(Path("data/motions"))) == 3
    assert {path.name: path.read_bytes() for path in Path("data/motions/clips").iterdir()} == first


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("motions: {source: nowhere}", "motions.source: expected a folder of motions or 'embedded', came nowhere"),
        ("motions: {sauce: mine}", "motions.sauce: expected"),
        (
            "motions: {source: mine, holdout_share: 1.5}",
            "motions.holdout_share: expected a number of at least 0, below 1, came 1.5",
        ),
        ("motions: {source: mine/other.npz}", "expected a whole .npz file"),
    ],
)
def test_a_wrong_setting_ends_in_one_line_and_status_2(capsys, text, said):
    user_files()
    params(text)
    assert said in ends_with(2, capsys)
    assert not Path("data/motions").exists()


def test_a_full_disk_ends_in_one_line_and_leaves_the_old_library(capsys, monkeypatch):
    user_files()
    params("motions: {source: mine, read: {csv_fps: 30, joints_23: asap, quaternion: xyzw}}")
    run_stage(motions.main, [])
    before = [clip.name for clip in read_library(Path("data/motions"))]
    capsys.readouterr()

    def full(path: Path, data: bytes) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr(writer, "put", full)
    assert "no space left" in ends_with(2, capsys)
    assert [clip.name for clip in read_library(Path("data/motions"))] == before
    assert sorted(path.name for path in Path("data").iterdir()) == ["motions", "retargets"]


def test_a_read_that_fails_halfway_leaves_no_clips_behind(capsys, monkeypatch):
    user_files()
    params("motions: {source: mine, read: {csv_fps: 30, joints_23: asap, quaternion: xyzw, processes: 1}}")

    def broken(*_):
        raise OSError(errno.ENOSPC, "No space left on device", "x")

    monkeypatch.setattr(motions, "write_library", broken)
    assert "no space left" in ends_with(2, capsys)
    assert list(Path(".").rglob("*.parquet")) == [] and not Path("data/motions").exists()


def test_many_notes_are_few_lines_and_all_of_them_in_a_table(capsys):
    words = (
        "raven",
        "heron",
        "gull",
        "crane",
        "finch",
        "robin",
        "swift",
        "owl",
        "jay",
        "duck",
        "goose",
        "swan",
        "lark",
    )
    kinds = [(f"{word}.bvh", f"read as a {word}") for word in words]
    heights = [(f"{n}.bvh", f"the floor was at {n / 100 - 0.04:+.3f} m, moved to 0") for n in range(9)]
    reading = Reading([], skipped_table([]), noted_table(kinds + heights))
    index = pd.DataFrame({"split": ["train"], "duration": [6.0], "source": ["a/b.bvh"], "licence": ["MIT"]})
    motions.tell(index, reading)
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("noted")]
    assert lines[0] == "noted: the floor was at -0.040 to +0.040 m, moved to 0: 9 files"
    assert lines[1] == "noted: read as a raven: raven.bvh"
    assert len(lines) == 13 and lines[-1] == "noted: 2 more kinds: data/motions/notes.csv"


def test_an_empty_folder_is_bad_input():
    Path("mine").mkdir()
    with pytest.raises(BadInput, match=r"came none\. docs"):
        motions.gather(motions.MotionsConfig(source="mine"), lambda clip: None)
