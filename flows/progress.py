"""Progress of the whole loop with the time left: a bar or plain lines in the terminal, an artifact on Prefect's page.

A thread of its own keeps it fresh. It only tells: whatever goes wrong in it, a server that is gone above all, costs
what would have been shown and never the run.
"""

import atexit
import logging
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Lock, Thread
from typing import Any, cast
from uuid import UUID

from rich.console import Console
from rich.live import Live
from rich.text import Text

from flows import expectations
from flows.stages import Stage
from flows.terminal import took as took_words

KEY = "progress"  # of the artifact on Prefect's page
_TICK, _TOLD, _LINE = 1.0, 5.0, 20.0  # seconds between looks, updates of the page, plain lines
_STRIKES = 3  # failed updates in a row after which the page is left alone

Tell = Callable[[float, str], None]
_running: dict[str, "Progress"] = {}


class Progress:
    """Progress of the stages: ended, running and to come; safe to be told by several threads."""

    def __init__(
        self,
        workspace: Path,
        stages: Iterable[Stage],
        width: int,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.workspace, self.stages, self.width, self.clock = workspace, list(stages), width, clock
        self.titles = {stage.name: stage.title for stage in self.stages}
        self.earlier = expectations.read(workspace)
        self.begun = clock()
        self.started: dict[str, float] = {}
        self.seen: dict[str, float] = {}
        self.ended: set[str] = set()
        self.lock = Lock()

    def start(self, name: str) -> None:
        """A stage begins."""
        with self.lock:
            self.started[name] = self.clock()

    def end(self, name: str, worked: bool) -> None:
        """A stage has ended; `worked`: it ran to its end and was not found up to date, so its duration tells."""
        with self.lock:
            since = self.started.pop(name, None)
            self.ended.add(name)
            if worked and since is not None:
                self.seen[name] = self.clock() - since
                expectations.remember(self.workspace, name, self.seen[name])

    def state(self) -> tuple[float, str]:
        """(percent done, a line for people)."""
        with self.lock:
            now = self.clock()
            elapsed = {name: now - since for name, since in self.started.items()}
            ended, seen = set(self.ended), dict(self.seen)
        expected = expectations.expect(self.stages, self.earlier, seen)
        left = expectations.seconds_left(self.stages, expected.seconds, ended, elapsed, self.width)
        doing = ", ".join(self.titles.get(name, name) for name in elapsed) or "between stages"
        count = f"{len(ended)} of {len(self.stages)} stages done"
        percent = share(expected.seconds, ended, elapsed)
        # A first estimate of 12 min became 24 min: what is not measured here is a range, which narrows with the work.
        most = left * (2 - percent / 100) if expected.source == expectations.ESTIMATE else left
        return percent, f"{words(left, most)}; now: {doing}; {count} ({expected.source})"


def share(expected: Mapping[str, float], ended: Iterable[str], elapsed: Mapping[str, float]) -> float:
    """Percent of the work that is done; a stage that runs counts for at most 95 % of its own."""
    total = sum(expected.values())
    done = sum(expected[name] for name in ended if name in expected)
    done += sum(min(since, 0.95 * expected[name]) for name, since in elapsed.items() if name in expected)
    return 100 * done / total if total else 100.0


def words(least: float, most: float) -> str:
    """`about 12 to 24 min left`, of two numbers of seconds: no finer than an estimate is."""
    low, high = round(least / 60), round(most / 60)
    if high == 0:
        return "less than 1 min left"
    return f"about {high} min left" if low == high else f"about {low} to {high} min left"


def begin(workspace: Path, stages: Iterable[Stage], busy: set[str], log: Any) -> Callable[[str], None]:
    """Show the progress of a run's busy stages from now on; call what comes back, with a last word, at its end."""
    mine = [stage for stage in stages if stage.name in busy]
    if not mine:
        return lambda last: None
    progress = Progress(workspace, mine, os.cpu_count() or 1)
    _running[str(workspace.resolve())] = progress
    shown, stop = Show(progress, terminal(), log, page()), Event()
    thread = Thread(target=shown.keep, args=(stop,), name="progress", daemon=True)
    thread.start()

    def close(last: str) -> None:
        if not stop.is_set():
            stop.set()
            thread.join(timeout=5.0)  # a page that does not answer is not waited for
            shown.last(last)

    atexit.register(close, "stopped")
    return close


@contextmanager
def stage(workspace: str, name: str) -> Iterator[dict[str, bool]]:
    """Around a stage's process; set "worked" in what it gives when the stage really ran and went well."""
    progress = _running.get(str(Path(workspace).resolve()))
    told = {"worked": False}
    if progress is not None:
        progress.start(name)
    try:
        yield told
    finally:
        if progress is not None:
            progress.end(name, told["worked"])


class Show:
    """Where the state goes: the terminal's last line or plain lines of the log, and Prefect's page."""

    def __init__(self, progress: Progress, console: Console | None, log: Any, tell: Tell | None) -> None:
        self.progress, self.console, self.log, self.tell = progress, console, log, tell
        self.strikes = 0
        self.line_at = self.told_at = -1e9
        self.counted = -1

    def keep(self, stop: Event) -> None:
        """Until `stop`."""
        try:
            if self.console is None:
                self.loop(stop, None)
                return
            with Live(console=self.console, transient=True, auto_refresh=False, redirect_stdout=False,
                      redirect_stderr=False) as live:  # fmt: skip
                self.loop(stop, live)
        except Exception as error:  # it only tells
            self.log.warning(f"the progress is shown no more: {error}")

    def loop(self, stop: Event, live: Live | None) -> None:
        """One look a tick."""
        while True:
            self.look(live)
            if stop.wait(_TICK):
                return

    def look(self, live: Live | None) -> None:
        """Show the state where it is due."""
        percent, line = self.progress.state()
        now = self.progress.clock()
        if live is not None:
            live.update(Text(f"{bar(percent)} {line}", no_wrap=True, overflow="ellipsis"), refresh=True)
        elif len(self.progress.ended) != self.counted and now - self.line_at >= _LINE:
            self.counted, self.line_at = len(self.progress.ended), now
            self.log.info(f"progress {percent:.0f} %: {line}")
        if now - self.told_at >= _TOLD:
            self.told_at = now
            self.to_page(percent, line)

    def to_page(self, percent: float, line: str) -> None:
        """Tell Prefect's page, while it answers."""
        if self.tell is None or self.strikes >= _STRIKES:
            return
        try:
            self.tell(percent, line)
            self.strikes = 0
        except Exception as error:  # a server that is gone must not end the run
            self.strikes += 1
            if self.strikes == _STRIKES:
                self.log.warning(f"the progress on Prefect's page stands still: {type(error).__name__}")

    def last(self, word: str) -> None:
        """The last state on the page, with how the run ended."""
        percent, _ = self.progress.state()
        took = took_words(self.progress.clock() - self.progress.begun)
        done = f"{len(self.progress.ended)} of {len(self.progress.stages)} stages done"
        self.to_page(percent, f"{word}: {done} in {took}")


def bar(percent: float, width: int = 20) -> str:
    """`[#####     ]  25 %`."""
    full = int(width * min(percent, 100) / 100)
    return f"[{'#' * full}{' ' * (width - full)}] {percent:3.0f} %"


def terminal() -> Console | None:
    """The console that Prefect's log lines go through, if it is a terminal: lines then appear above the bar."""
    for handler in [*logging.getLogger("prefect").handlers, *logging.getLogger().handlers]:
        console = getattr(handler, "console", None)
        if isinstance(console, Console) and console.is_terminal and not console.is_dumb_terminal:
            return console
    return None


def page() -> Tell | None:
    """Something that updates a new artifact of the flow run; None where Prefect's server takes none."""
    from prefect.artifacts import create_progress_artifact, update_progress_artifact

    try:
        # Prefect types it as a coroutine, too, which it is in async code alone.
        made = cast(UUID, create_progress_artifact(0.0, key=KEY, description="the loop begins"))
    except Exception:  # the run shows in the terminal all the same
        return None
    return lambda percent, line: _drop(update_progress_artifact(made, min(percent, 100.0), line))


def _drop(_: object) -> None:
    """Drop a value."""
