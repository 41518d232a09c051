"""Finding, hitting and waiting for processes of one cell: all of them carry the cell's mark in their environment."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import psutil

MARK = "BUMBLEBEE_KILLS"
PATIENCE = 300.0  # [s] until a command that should have ended counts as one that does not end
GRACE = 10.0  # [s] that children have to follow


def start(words: Sequence[str], folder: Path, env: Mapping[str, str], mark: str, log: Path) -> subprocess.Popen[bytes]:
    """`python WORDS` in `folder` with the mark, everything that it says in `log`."""
    with log.open("ab") as out:
        return subprocess.Popen(
            [sys.executable, *words],
            cwd=folder,
            env={**env, MARK: mark},
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=out,
            preexec_fn=_listen,
        )


def _listen() -> None:
    """Ctrl-C reaches the command also where a shell that runs this in the background has switched it off."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def marked(mark: str) -> list[psutil.Process]:
    """All living processes that carry the mark, zombies apart."""
    found = []
    for process in psutil.process_iter(["pid"]):
        try:
            alive = process.status() != psutil.STATUS_ZOMBIE and process.pid != os.getpid()
            if alive and process.environ().get(MARK) == mark:
                found.append(process)
        except psutil.Error:
            continue
    return found


def find(root: int, words: Sequence[str]) -> psutil.Process | None:
    """The oldest descendant of `root`, itself included, with an argument that ends in each of `words`."""
    hits = []
    try:
        top = psutil.Process(root)
        family = [top, *top.children(recursive=True)]
    except psutil.Error:
        return None
    for process in family:
        try:
            line = process.cmdline()
        except psutil.Error:
            continue
        if all(any(part.endswith(word) for part in line) for word in words):
            hits.append(process)
    return min(hits, key=lambda process: process.create_time(), default=None)


def wait_for(words: Sequence[str], running: subprocess.Popen[bytes]) -> psutil.Process:
    """The process of the command's family with these words, as soon as it is there."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end and running.poll() is None:
        found = find(running.pid, words)
        if found is not None:
            return found
        time.sleep(0.05)
    raise RuntimeError(f"no process {' '.join(words)} came")


def wait_end(running: subprocess.Popen[bytes]) -> tuple[int | None, float]:
    """Exit status, None where it does not end, and how long that took [s]."""
    began = time.monotonic()
    try:
        return running.wait(PATIENCE), time.monotonic() - began
    except subprocess.TimeoutExpired:
        return None, time.monotonic() - began


def orphans(mark: str) -> list[str]:
    """Processes that still live after the grace; they are killed then."""
    end = time.monotonic() + GRACE
    while marked(mark) and time.monotonic() < end:
        time.sleep(0.2)
    names = []
    for process in marked(mark):
        try:
            names.append(" ".join(process.cmdline()[1:4]))
            process.kill()
        except psutil.Error:
            continue
    return names


def last_line(log: Path) -> str:
    """The last thing that was said."""
    lines = [line for line in log.read_text(errors="replace").splitlines() if line.strip()]
    return lines[-1].strip()[:160] if lines else ""
