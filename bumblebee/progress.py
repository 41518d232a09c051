"""Progress of long work: rate and time left, as a bar on a terminal and as a line now and then elsewhere."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

LINE_EVERY = 10.0  # [s] between two plain lines
SECONDS = "s"
"""The unit of work that ends after a given time."""


def clock(seconds: float) -> str:
    """A duration [s] as `m:ss` or `h:mm:ss`."""
    minutes, secs = divmod(round(max(seconds, 0.0)), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{secs:02d}" if hours else f"{minutes}:{secs:02d}"


def line(what: str, done: float, total: float, elapsed: float, unit: str, note: str = "") -> str:
    """One plain line: how far, how fast, how long still."""
    rate = done / elapsed if elapsed > 0 else 0.0
    left = clock((total - done) / rate) if rate > 0 else "?"
    share = 100.0 * done / total if total else 100.0
    parts = [f"{what}: {done:,.0f}/{total:,.0f} {unit} ({share:.0f} %)", pace(rate, unit), f"{left} left", note]
    return ", ".join(part for part in parts if part)


def pace(rate: float, unit: str) -> str:
    """How fast; nothing where the work is counted in seconds."""
    return "" if unit == SECONDS else f"{rate:,.1f} {unit}/s"


class Progress:
    """Counts finished work and shows it; `start` is what an earlier run had already done.

    Call `update(n)` after n more units, optionally with a short note (a loss, a success rate).
    """

    def __init__(self, total: float, what: str, unit: str, show: Callable[[str], None], start: float = 0.0) -> None:
        self.total, self.what, self.unit = total, what, unit
        self.start = self.done = start
        self._show, self._began, self._shown = show, time.monotonic(), time.monotonic()

    def update(self, n: float = 1, note: str = "") -> None:
        """Count `n` more units."""
        self.done += n
        now = time.monotonic()
        if now - self._shown >= LINE_EVERY:
            self._shown = now
            self._show(self.text(note))

    def text(self, note: str = "") -> str:
        """The plain line as of now; the rate counts this run's work only."""
        elapsed = time.monotonic() - self._began
        fresh, open_work = self.done - self.start, self.total - self.start
        text = line(self.what, fresh, open_work, elapsed, self.unit, note)
        return f"{text} (after {self.start:,.0f} from before)" if self.start else text

    def close(self) -> None:
        """Say how long it took."""
        elapsed = time.monotonic() - self._began
        fresh = self.done - self.start
        rate = fresh / elapsed if elapsed > 0 else 0.0
        fast = pace(rate, self.unit)
        self._show(f"{self.what}: {fresh:,.0f} {self.unit} in {clock(elapsed)}{fast and f' ({fast})'}")


class _Bar(Progress):
    """Progress bar on a terminal, by rich."""

    def __init__(self, total: float, what: str, unit: str, start: float) -> None:
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as RichProgress

        super().__init__(total, what, unit, lambda text: print(text, flush=True), start)
        columns = ("{task.description}", BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[extra]}"))
        self._bar = RichProgress(*columns, TimeRemainingColumn(), transient=True)
        self._bar.start()
        self._task = self._bar.add_task(what, total=total, completed=int(start), extra="")

    def update(self, n: float = 1, note: str = "") -> None:
        self.done += n
        elapsed = max(time.monotonic() - self._began, 1e-9)
        extra = f"{pace((self.done - self.start) / elapsed, self.unit)} {note}"
        self._bar.update(self._task, total=self.total, completed=int(self.done), extra=extra)

    def close(self) -> None:
        self._bar.stop()
        super().close()


@contextmanager
def progress(total: float, what: str, unit: str = "steps", start: float = 0.0) -> Iterator[Progress]:
    """Show the progress of `total` units of work named `what`.

    Args:
        total: units of work in all, those of an earlier run included.
        what: a few words that name the work.
        unit: the plural of one unit ("steps", "clips", "windows"), or `SECONDS`.
        start: units that an earlier, interrupted run had already done.

    Yields:
        An object whose `update(n, note="")` counts n finished units.
    """
    shown: Progress
    if sys.stdout.isatty():
        shown = _Bar(total, what, unit, start)
    else:
        shown = Progress(total, what, unit, lambda text: print(text, flush=True), start)
    try:
        yield shown
    finally:
        shown.close()
