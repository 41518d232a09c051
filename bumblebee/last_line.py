"""The last line of defence of every command: no traceback on the terminal, whatever happens.

Bad input is one line and status 2; anything unforeseen one line, a log file with the traceback, and status 1. A signal
that ends the process lets it clean up first.
"""

import contextlib
import errno
import os
import select
import signal
import sqlite3
import stat
import sys
import tempfile
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime
from types import FrameType

from bumblebee.errors import EXIT_BAD_INPUT, BadInput

EXIT_UNFORESEEN = 1
EXIT_INTERRUPTED = 130
_DISK = {
    errno.ENOSPC: "no space left",
    errno.EDQUOT: "quota used up",
    errno.EROFS: "a read-only disk",
    errno.EACCES: "no permission to write",
}
OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
_SQLITE = ("database or disk is full", "disk I/O error")
_DO = "Free some space or choose another folder, then run again."


class Stopped(BaseException):
    """A signal told the process to end; `number` says which."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number


def guarded(command: Callable[[], int | None]) -> int:
    """Run a command and return its exit status; every exception becomes one line on standard error.

    0 or what the command returns; 2 for bad input and for a disk that takes nothing; 130 for Ctrl-C, 143 for SIGTERM,
    129 for SIGHUP; 1 for anything else, with the traceback in a file that the line names. What the command makes nobody
    else may change, whatever the umask.
    """
    os.umask(os.umask(OTHERS_WRITE) | OTHERS_WRITE)
    try:
        with _signals():
            status = int(command() or 0)
            sys.stdout.flush()  # a full disk or a closed pipe shows here and not at the interpreter's end
            return status
    except BadInput as error:
        return _say(str(error), EXIT_BAD_INPUT)
    except KeyboardInterrupt:
        _end_workers()
        return _say("stopped", EXIT_INTERRUPTED)
    except Stopped as stop:
        _end_workers()
        return _say(f"stopped by {stop}", 128 + stop.number)
    except Exception as error:
        if isinstance(error, OSError) and _stdout_is_gone():
            if isinstance(error, BrokenPipeError):  # `| head`: nobody reads any more
                return EXIT_UNFORESEEN
            error.filename = error.filename or "the standard output"
        line = full_disk(error)
        return _say(line, EXIT_BAD_INPUT) if line else _say(unforeseen(error), EXIT_UNFORESEEN)


def _end_workers() -> None:
    """End the processes that work for this one: its exit would wait, for one just being started without end."""
    if "multiprocessing" in sys.modules:
        for child in sys.modules["multiprocessing"].active_children():
            child.terminate()


def full_disk(error: Exception) -> str | None:
    """The one line for a disk that takes nothing, whoever met it; None for any other error."""
    return disk_line(error) if isinstance(error, OSError) else sqlite_line(error)


def disk_line(error: OSError) -> str | None:
    """The one line for a full disk or a folder without write access; None for any other error."""
    if error.errno not in _DISK:
        return None
    place = error.filename or _here()
    return str(BadInput(place, "a disk that takes the output", _DISK[error.errno], _DO))


def sqlite_line(error: Exception) -> str | None:
    """Line for a database of SQLite's that could not be written, such as DVC's; None for any other error."""
    if not isinstance(error, sqlite3.OperationalError) or str(error) not in _SQLITE:
        return None
    return str(BadInput(_here(), "a disk that takes the output", str(error), _DO))


def unforeseen(error: BaseException, argv: Sequence[str] | None = None) -> str:
    """One line for an error that nobody foresaw; the traceback goes to a log file that only the owner can read."""
    said = " ".join(f"{type(error).__name__}: {error}".split())[:200]
    text = "".join(traceback.format_exception(error))
    command = " ".join(sys.argv if argv is None else argv)
    head = f"{datetime.now(UTC).isoformat(timespec='seconds')}\n{command}\nin {_here()}\nPython {sys.version}\n\n"
    try:
        handle, name = tempfile.mkstemp(prefix="bumblebee-", suffix=".log")
        with os.fdopen(handle, "w", encoding="utf-8", errors="replace") as stream:
            stream.write(head + text)
    except OSError:
        return f"internal error: {said}; no traceback could be written"
    return f"internal error: {said}; the traceback is kept, please report it with {name}"


@contextlib.contextmanager
def _signals() -> Iterator[None]:
    """SIGTERM and SIGHUP as an exception meanwhile, so that half outputs are removed; handlers that others set stay."""
    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    if threading.current_thread() is not threading.main_thread():
        numbers = []
    numbers = [number for number in numbers if signal.getsignal(number) == signal.SIG_DFL]
    for number in numbers:
        signal.signal(number, _stop)
    try:
        yield
    finally:
        for number in numbers:
            signal.signal(number, signal.SIG_DFL)


def _stop(number: int, frame: FrameType | None) -> None:
    signal.signal(number, signal.SIG_IGN)  # a second one must not end the cleaning up
    raise Stopped(number)


def _stdout_is_gone() -> bool:
    """Whether the standard output takes nothing more; then it is let go, or the interpreter would say so at its end."""
    with contextlib.suppress(ValueError):  # a stream without a file, as tests have it
        number = sys.stdout.fileno()
        try:
            sys.stdout.flush()
            gone = _unread(number)
        except OSError:
            gone = True
        if gone:
            os.dup2(os.open(os.devnull, os.O_WRONLY), number)
        return gone
    return False


def _unread(number: int) -> bool:
    """Whether a file descriptor is a pipe that nobody reads."""
    if not hasattr(select, "poll"):
        return False
    asked = select.poll()
    asked.register(number, 0)
    return any(event & (select.POLLERR | select.POLLHUP) for _, event in asked.poll(0))


def _here() -> str:
    try:
        return os.getcwd()
    except OSError:
        return "a folder that is gone"


def _say(line: str, status: int) -> int:
    with contextlib.suppress(OSError):  # a terminal that was closed
        print(line, file=sys.stderr, flush=True)
    return status
