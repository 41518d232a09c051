"""Whatever happens, a command says one line and ends with a status that tells what it was."""

import os
import pickle
import signal
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.last_line import guarded
from bumblebee.measured.rollout import BadRollout


def raising(error: BaseException):
    def command() -> int:
        raise error

    return command


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (BadInput("a", "b", "c"), 2),
        (OSError(28, "No space left on device", "x"), 2),
        (OSError(5, "Input/output error"), 1),
        (sqlite3.OperationalError("disk I/O error"), 2),
        (sqlite3.OperationalError("database or disk is full"), 2),
        (sqlite3.OperationalError("no such table: x"), 1),
        (RuntimeError("two\nlines"), 1),
        (RecursionError("deep"), 1),
        (KeyboardInterrupt(), 130),
    ],
)
def test_every_error_is_one_line(error: BaseException, status: int, capsys: pytest.CaptureFixture[str]):
    assert guarded(raising(error)) == status
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "Traceback" not in said


@pytest.mark.parametrize(
    "error", [BadInput("a.csv", "a number", "x", "Give one."), BadRollout("a.csv", "q", "finite", "numbers", "nan", "")]
)
def test_bad_input_crosses_processes(error: BadInput):
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert vars(again) == vars(error)


def test_the_traceback_of_the_unforeseen_is_kept_for_the_owner(capsys: pytest.CaptureFixture[str]):
    guarded(raising(RuntimeError("surprise")))
    log = Path(capsys.readouterr().err.split("with ")[-1].strip())
    assert "Traceback" in log.read_text() and "surprise" in log.read_text()
    assert log.stat().st_mode & 0o077 == 0
    log.unlink()


def test_success_is_zero_or_what_the_command_says():
    assert guarded(lambda: None) == 0
    assert guarded(lambda: 3) == 3


@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)])
def test_a_signal_lets_the_command_clean_up_and_is_one_line(
    number: int, status: int, capsys: pytest.CaptureFixture[str]
):
    cleaned, before = [], signal.getsignal(number)

    def command() -> None:
        try:
            os.kill(os.getpid(), number)
        finally:
            cleaned.append(True)

    assert guarded(command) == status
    assert cleaned and capsys.readouterr().err.count("\n") == 1
    assert signal.getsignal(number) == before


def test_handlers_of_the_command_itself_stay():
    seen = []
    before = signal.signal(signal.SIGTERM, lambda *_: seen.append(True))
    try:
        assert guarded(lambda: os.kill(os.getpid(), signal.SIGTERM)) == 0
    finally:
        signal.signal(signal.SIGTERM, before)
    assert seen


def piped(target: str) -> subprocess.CompletedProcess:
    """A command that prints much, its output going to `target` in a shell."""
    code = "from bumblebee.last_line import guarded; raise SystemExit(guarded(lambda: print('x\\n' * 100_000)))"
    command = f'{{ {sys.executable} -c "{code}"; echo $? >&2; }} {target}'
    environment = os.environ | {"PYTHONPATH": str(Path.cwd())}
    return subprocess.run(command, shell=True, capture_output=True, text=True, env=environment, executable="/bin/sh")


def test_a_reader_that_had_enough_closes_it_quietly():
    assert piped("| head -1").stderr.strip() == "1"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="Linux alone has a full device")
def test_an_output_that_takes_nothing_is_one_line():
    said = piped("> /dev/full").stderr.strip().splitlines()
    assert said[1:] == ["2"] and "no space left" in said[0]


def test_a_working_folder_that_is_gone_hides_no_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    assert guarded(raising(RuntimeError("surprise"))) == 1
    said = capsys.readouterr().err
    assert "surprise" in said
    Path(said.split("with ")[-1].strip()).unlink()


def test_what_a_command_makes_nobody_else_may_change_whatever_the_umask(tmp_path: Path):
    folder = tmp_path / "folder"

    def make() -> None:
        folder.mkdir()
        (folder / "file").touch()

    old = os.umask(0)
    try:
        assert guarded(make) == 0
    finally:
        os.umask(old)
    assert [path.stat().st_mode & 0o777 for path in (folder, folder / "file")] == [0o755, 0o644]
