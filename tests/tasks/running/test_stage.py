"""Services that stages share: whole outputs or none, one line and status 2 for bad input, scratch by inputs."""

import errno
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from tasks.running import stage
from tasks.running.stage import output_file, output_folder, run_stage, scratch


@pytest.fixture(autouse=True)
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DVC_STAGE", raising=False)
    monkeypatch.setattr(stage, "_used_scratch", set())
    return tmp_path


def test_a_folder_appears_whole(workspace: Path):
    with output_folder("data/x") as folder:
        (folder / "a").write_text("1")
        assert not Path("data/x").exists()
    assert Path("data/x/a").read_text() == "1"
    assert [path.name for path in Path("data").iterdir()] == ["x"]


def test_a_failure_leaves_the_old_folder_and_nothing_else(workspace: Path):
    with output_folder("data/x") as folder:
        (folder / "a").write_text("old")
    with pytest.raises(RuntimeError), output_folder("data/x") as folder:
        (folder / "a").write_text("new")
        raise RuntimeError
    assert Path("data/x/a").read_text() == "old"
    assert [path.name for path in Path("data").iterdir()] == ["x"]


def test_a_new_folder_replaces_the_old_one_entirely(workspace: Path):
    for name in ("a", "b"):
        with output_folder("x") as folder:
            (folder / name).touch()
    assert [path.name for path in Path("x").iterdir()] == ["b"]


def test_what_a_killed_run_left_behind_is_cleared(workspace: Path):
    Path(".x.writing").mkdir()
    Path(".x.writing/half").touch()
    with output_folder("x") as folder:
        assert list(folder.iterdir()) == []


def test_a_file_appears_whole_or_not_at_all(workspace: Path):
    with pytest.raises(RuntimeError), output_file("data/x.json") as file:
        file.write_text("half")
        raise RuntimeError
    assert list(Path("data").iterdir()) == []
    with output_file("data/x.json") as file:
        file.write_text("whole")
    assert Path("data/x.json").read_text() == "whole"


def test_parameters_of_main_are_its_options():
    seen = []

    def main(cluster: str, round: int) -> None:
        seen.append((cluster, round))

    run_stage(main, ["--cluster", "c0", "--round", "2"])
    assert seen == [("c0", 2)]


def test_bad_input_is_one_line_and_status_2(capsys: pytest.CaptureFixture[str]):
    def main() -> None:
        raise BadInput("a.csv, row 3", "36 columns", "35")

    with pytest.raises(SystemExit) as ended:
        run_stage(main, [])
    assert ended.value.code == 2
    assert capsys.readouterr().err == "a.csv, row 3: expected 36 columns, came 35\n"


def test_a_full_disk_is_one_line_and_status_2_and_nothing_is_half_written(capsys: pytest.CaptureFixture[str]):
    def main() -> None:
        with output_folder("data/x") as folder:
            (folder / "a").touch()
            raise OSError(errno.ENOSPC, "No space left on device", str(folder / "a"))

    with pytest.raises(SystemExit) as ended:
        run_stage(main, [])
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "no space left" in error and "data/.x.writing/a" in error
    assert list(Path("data").iterdir()) == []


@pytest.mark.parametrize("error", [OSError(errno.ENOENT, "no such file", "x"), RuntimeError("two\nlines")])
def test_other_errors_are_one_line_and_status_1_and_their_traceback_is_in_a_log(
    error: Exception, capsys: pytest.CaptureFixture[str]
):
    def main() -> None:
        raise error

    with pytest.raises(SystemExit) as ended:
        run_stage(main, [])
    assert ended.value.code == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "Traceback" not in said
    log = Path(said.split("with ")[-1].strip())
    assert "Traceback" in log.read_text() and type(error).__name__ in log.read_text()
    log.unlink()


def test_a_full_database_is_a_full_disk(capsys: pytest.CaptureFixture[str]):
    def main() -> None:
        raise RuntimeError("(sqlite3.OperationalError) database or disk is full")

    with pytest.raises(SystemExit) as ended:
        run_stage(main, [])
    assert ended.value.code == 2 and "no space left" in capsys.readouterr().err


def test_a_labs_database_that_is_away_is_one_line_from_whatever_the_stage_asked(
    workspace: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    def main() -> None:
        raise RuntimeError('connection to server at "127.0.0.1", port 1 failed: Connection refused')

    for lab, status, said in (
        (object(), 2, "expected the lab's database and store to answer"),
        (None, 1, "RuntimeError"),
    ):
        monkeypatch.setattr("tasks.running.stage.read_lab", lambda folder, lab=lab: lab)
        with pytest.raises(SystemExit) as ended:
            run_stage(main, [])
        line = capsys.readouterr().err
        assert ended.value.code == status and said in line and line.count("\n") == 1
        if lab is None:
            Path(line.split("with ")[-1].strip()).unlink()


def test_scratch_survives_a_run_that_did_not_complete_and_goes_with_one_that_did(workspace: Path):
    (scratch("base") / "checkpoint.pt").touch()
    assert (scratch("base") / "checkpoint.pt").exists()
    run_stage(lambda: scratch("base"), [])
    assert not Path(".scratch/base").exists()


def test_scratch_is_emptied_when_what_it_was_made_from_changed(workspace: Path):
    source = Path("clips")
    source.mkdir()
    (source / "a").write_text("1")
    (scratch("base", source, "lr=1") / "checkpoint.pt").touch()
    assert (scratch("base", source, "lr=1") / "checkpoint.pt").exists()
    assert not (scratch("base", source, "lr=2") / "checkpoint.pt").exists()
    (scratch("base", source, "lr=2") / "checkpoint.pt").touch()
    (source / "a").write_text("2")
    assert not (scratch("base", source, "lr=2") / "checkpoint.pt").exists()
