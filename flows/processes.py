"""Processes of this machine: which one is meant (numbers are used again), whether it runs, how it is ended."""

import os
import signal
import time
from collections.abc import Iterable
from contextlib import suppress

import psutil

YOUNG = 5.0  # [s] in which an interpreter may still be starting, where Ctrl-C shows a traceback that is nobody's
STOP_LIMIT = 5.0  # [s] until a process that was asked to end is killed


def born(pid: int) -> float:
    """When the process started, seconds since 1970; with its number it names one process for ever. 0 where none."""
    try:
        return float(psutil.Process(pid).create_time())
    except psutil.Error:
        return 0.0


def same(pid: int, when: float) -> bool:
    """Whether the process of this number that started then still runs."""
    try:
        found = psutil.Process(pid)
        return abs(found.create_time() - when) < 1e-3 and found.status() != psutil.STATUS_ZOMBIE
    except psutil.Error:
        return False


def alive(pid: int) -> bool:
    """Whether a process of this number runs."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def below(pid: int) -> list[psutil.Process]:
    """Everything that the process started, and what that started."""
    try:
        return list(psutil.Process(pid).children(recursive=True))
    except psutil.Error:
        return []


def stop(pids: Iterable[int], limit: float = STOP_LIMIT) -> None:
    """End the processes, each the head of a group, and everything that they started; first politely."""
    pids = list(pids)
    for pid in pids:
        _signal(pid, signal.SIGTERM)
    end = time.monotonic() + limit
    while any(_running(pid) for pid in pids) and time.monotonic() < end:
        time.sleep(0.05)
    for pid in pids:
        _signal(pid, signal.SIGKILL)  # what is left of its group
        _running(pid)


def end_tree(pid: int, limit: float = STOP_LIMIT) -> None:
    """End a process and everything below it: SIGINT to what it started, SIGTERM to itself, SIGKILL to what is left.

    What was started just now gets SIGTERM as well: it has nothing to clear up yet.
    """
    tree = below(pid)
    for process in tree:
        with suppress(psutil.Error):
            young = time.time() - process.create_time() < YOUNG
            process.send_signal(signal.SIGTERM if young else signal.SIGINT)
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGTERM)
    end = time.monotonic() + limit
    while (_running(pid) or any(_there(process) for process in tree)) and time.monotonic() < end:
        time.sleep(0.05)
    for process in [*tree, *below(pid)]:
        with suppress(psutil.Error):
            process.kill()
    _signal(pid, signal.SIGKILL)
    _running(pid)


def _there(process: psutil.Process) -> bool:
    try:
        return bool(process.is_running() and process.status() != psutil.STATUS_ZOMBIE)
    except psutil.Error:
        return False


def _running(pid: int) -> bool:
    try:
        return os.waitpid(pid, os.WNOHANG) == (0, 0)
    except ChildProcessError:  # another process's child, or already waited for
        return alive(pid)


def _signal(pid: int, number: int) -> None:
    with suppress(ProcessLookupError):
        os.killpg(pid, number)
