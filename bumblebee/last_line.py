"""The last line of defence of every command: no traceback on the terminal, whatever happens.

Bad input is one line and status 2; anything unforeseen one line, a log file with the traceback, and status 1.
"""

import errno
import os
import sys
import tempfile
import traceback
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path

from bumblebee.errors import EXIT_BAD_INPUT, BadInput

EXIT_UNFORESEEN = 1
EXIT_INTERRUPTED = 130
_DISK = {
    errno.ENOSPC: "no space left",
    errno.EDQUOT: "quota used up",
    errno.EROFS: "a read-only disk",
    errno.EACCES: "no permission to write",
}


def guarded(command: Callable[[], int | None]) -> int:
    """Run a command and return its exit status; every exception becomes one line on standard error.

    0 or what the command returns; 2 for bad input and for a disk that takes nothing; 130 for Ctrl-C; 1 for anything
    else, with the traceback in a file that the line names.
    """
    try:
        return int(command() or 0)
    except BadInput as error:
        return _say(str(error), EXIT_BAD_INPUT)
    except KeyboardInterrupt:
        return _say("stopped", EXIT_INTERRUPTED)
    except BrokenPipeError:  # `| head`: nobody reads any more, and the interpreter would say so again at its end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_UNFORESEEN
    except Exception as error:
        line = disk_line(error) if isinstance(error, OSError) else None
        return _say(line, EXIT_BAD_INPUT) if line else _say(unforeseen(error), EXIT_UNFORESEEN)


def disk_line(error: OSError) -> str | None:
    """The one line for a full disk or a folder without write access; None for any other error."""
    if error.errno not in _DISK:
        return None
    place = error.filename or Path.cwd()
    do = "Free some space or choose another folder, then run again."
    return str(BadInput(place, "a disk that takes the output", _DISK[error.errno], do))


def unforeseen(error: BaseException, argv: Sequence[str] | None = None) -> str:
    """One line for an error that nobody foresaw; the traceback goes to a log file that only the owner can read."""
    said = " ".join(f"{type(error).__name__}: {error}".split())[:200]
    text = "".join(traceback.format_exception(error))
    command = " ".join(sys.argv if argv is None else argv)
    head = f"{datetime.now(UTC).isoformat(timespec='seconds')}\n{command}\nin {os.getcwd()}\nPython {sys.version}\n\n"
    try:
        handle, name = tempfile.mkstemp(prefix="bumblebee-", suffix=".log")
        with os.fdopen(handle, "w", encoding="utf-8", errors="replace") as stream:
            stream.write(head + text)
    except OSError:
        return f"an error that should not happen: {said}. No log could be written"
    return f"an error that should not happen: {said}. Please report it with {name}"


def _say(line: str, status: int) -> int:
    print(line, file=sys.stderr, flush=True)
    return status
