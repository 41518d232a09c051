"""Work of a keeper while the loop runs in a process of its own: wait, pass on what ends it, notice a lost server."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType

from flows.environment import environment
from flows.processes import end_tree
from flows.servers.servers import HOME, Addresses

LOOK_EVERY = 0.2  # [s]
WALK = [sys.executable, "-m", "flows.walk"]
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
SEEN = {"mlflow": "MLflow's server ended: its page is closed; the stages continue and still record their runs"}


@contextmanager
def ended_in_order() -> Iterator[None]:
    """For the length of a block SIGTERM and SIGHUP end the program as Ctrl-C does: orderly, and only once.

    What was ignored when the program started (`nohup`) stays ignored.
    """
    before = {number: signal.getsignal(number) for number in ENDING}

    def end(number: int, frame: FrameType | None) -> None:
        for each in ENDING:
            signal.signal(each, signal.SIG_IGN)  # impatience must not interrupt the clearing up
        if number == signal.SIGHUP:
            _leave_terminal()
        raise KeyboardInterrupt

    for number, was in before.items():
        if was is not signal.SIG_IGN:
            signal.signal(number, end)
    try:
        yield
    finally:
        for number, was in before.items():
            signal.signal(number, was)


def _leave_terminal() -> None:
    """The terminal is gone: what is still said goes nowhere, and must not fail."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            if stream.isatty():
                os.dup2(nowhere, stream.fileno())


def attend(folder: Path, addresses: Addresses, *options: str, until_lost: bool = False) -> int:
    """Run `python -m flows.walk` with these options until it ends; its exit status.

    When Prefect's server goes away a walk is told so and goes on to its end.

    Args:
        folder: the workspace.
        addresses: of the servers that it uses.
        options: of flows.walk.
        until_lost: end it instead when Prefect's server goes away.
    """
    settings = environment(folder)
    settings["PREFECT_API_URL"] = f"{addresses.prefect}/api"
    settings["BUMBLEBEE_WORKSPACE"] = str(folder.resolve())
    # A session of its own: what ends this process ends that one in order, and not both at once.
    process = subprocess.Popen(
        [*WALK, *options], cwd=HOME, env=settings, stdin=subprocess.DEVNULL, start_new_session=True
    )
    gone: set[str] = set()
    try:
        while process.poll() is None:
            time.sleep(LOOK_EVERY)
            for name in set(addresses.lost()) - gone:
                gone.add(name)
                if name == "prefect" and until_lost:
                    print(f"Prefect's server went away ({addresses.prefect}): nothing waits here", file=sys.stderr)
                    return 1
                print(SEEN.get(name) or _without_prefect(process), file=sys.stderr, flush=True)
    finally:
        end_tree(process.pid)
    return process.returncode if process.returncode >= 0 else 1


def _without_prefect(process: "subprocess.Popen[bytes]") -> str:
    with suppress(ProcessLookupError):
        process.send_signal(signal.SIGUSR1)
    return "Prefect's server went away: the stages go on and what they finish is kept, its page misses the rest"
