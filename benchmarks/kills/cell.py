"""One cell of the matrix: what is hit, while which stage is at work, and how; and what came of it."""

import signal
from dataclasses import dataclass

SIGNALS = {"-9": signal.SIGKILL, "INT": signal.SIGINT, "TERM": signal.SIGTERM, "HUP": signal.SIGHUP}


@dataclass(frozen=True)
class Cell:
    """One cell of the matrix: what is done."""

    target: str
    """A process of the loop (keeper, flow, dvc, stage, recorder, prefect, mlflow), or a command of the library."""
    stage: str
    """The stage, as DVC calls it, that is at work when it happens; for a command what it works on."""
    how: str
    """-9, INT, TERM, HUP, `disk full`, `read-only` or `two at once`."""

    @property
    def name(self) -> str:
        """For people and for the file of results."""
        return f"{self.target} / {self.stage} / {self.how}"


@dataclass(frozen=True)
class Outcome:
    """Outcome of a cell; the cell holds where `broken` is empty."""

    cell: str
    seconds: float
    """From the blow to the end of the command [s]; of what was left alone, to its own end."""
    status: int | None
    """The command's exit status; negative: the signal that ended it. None: it did not end."""
    said: str
    """Its last line."""
    lost: tuple[str, ...]
    """Stages that were finished before and are not any more."""
    orphans: tuple[str, ...]
    """Processes that outlived the command by ten seconds."""
    left: tuple[str, ...]
    """Half-written files and folders in a place that is read."""
    traceback: bool
    """Whether a traceback reached the terminal."""
    again: int | None
    """Exit status of the same command, started again."""

    @property
    def broken(self) -> list[str]:
        """Conditions that do not hold."""
        found = [f"lost {', '.join(self.lost)}"] if self.lost else []
        found += [f"orphans: {', '.join(self.orphans)}"] if self.orphans else []
        found += [f"half written: {', '.join(self.left)}"] if self.left else []
        found += ["traceback"] if self.traceback else []
        found += ["did not end"] if self.status is None else []
        found += [f"again: status {self.again}"] if self.again != 0 else []
        return found
