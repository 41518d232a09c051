"""Whatever happens, a command says one line and ends with a status that tells what it was."""

from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.last_line import guarded


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


def test_the_traceback_of_the_unforeseen_is_kept_for_the_owner(capsys: pytest.CaptureFixture[str]):
    guarded(raising(RuntimeError("surprise")))
    log = Path(capsys.readouterr().err.split("with ")[-1].strip())
    assert "Traceback" in log.read_text() and "surprise" in log.read_text()
    assert log.stat().st_mode & 0o077 == 0
    log.unlink()


def test_success_is_zero_or_what_the_command_says():
    assert guarded(lambda: None) == 0
    assert guarded(lambda: 3) == 3
