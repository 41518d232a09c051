"""Terminal of a loop: one line a stage, warnings and errors; all lines of all stages are in the workspace's log."""

import logging
from pathlib import Path

from flows.environment import SERVERS

FILE = Path(SERVERS, "loop.log")
"""Log file below a workspace; runs are appended."""
NOTICE = (logging.INFO + logging.WARNING) // 2
"""Level of the lines that a quiet terminal shows."""


def to_file(folder: Path, verbose: bool) -> None:
    """Write all that this process logs to the workspace's log file, and only notices and worse to the terminal.

    Args:
        folder: the workspace.
        verbose: leave everything in the terminal, too.
    """
    root = logging.getLogger()
    consoles = list(root.handlers)
    file = logging.FileHandler(folder / FILE, encoding="utf-8", errors="backslashreplace")
    file.setFormatter(next((console.formatter for console in consoles), None))
    file.handleError = drop  # type: ignore[method-assign]
    root.addHandler(file)
    for console in [] if verbose else consoles:
        console.addFilter(is_notice)  # a level would not stay: Prefect sets those of its handlers again


def drop(record: logging.LogRecord) -> None:
    """Leave out a line that the disk did not take: the stage that needs the disk says so itself."""


def is_notice(record: logging.LogRecord) -> bool:
    """Whether a quiet terminal shows a line."""
    return record.levelno >= NOTICE


def took(seconds: float) -> str:
    """A duration in minutes and seconds: `2:05 min`."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes}:{rest:02d} min"
