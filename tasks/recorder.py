"""A process beside a stage that has MLflow ready by the time the stage has something to log.

MLflow takes seconds to import; here it does so on another core while the stage works.
"""

import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

from tasks import registry

_started: list[subprocess.Popen[str]] = []


def start() -> None:
    """Start the process; it ends by itself with this one."""
    command = [sys.executable, "-m", "tasks.recorder"]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    _started.append(process)


def record(run: dict[str, Any]) -> None:
    """Write one finished run through the process that was started, or here where none was.

    Args:
        run: the arguments of `registry.log_run`.

    Raises:
        RuntimeError: with MLflow's last word, where the run could not be written.
    """
    if not _started:
        registry.log_run(**run)
        return
    process = _started.pop()
    _, said = process.communicate(json.dumps(_plain(run)))
    if process.returncode:
        raise RuntimeError((said.strip().splitlines() or ["the recorder ended without a word"])[-1])


def _plain(run: dict[str, Any]) -> dict[str, Any]:
    """The same in what JSON knows."""
    files = [str(path) for path in run["artifacts"]]
    curve = None if run["curve"] is None else str(run["curve"])
    return {**run, "params": registry.flatten(run["params"]), "curve": curve, "artifacts": files}


def main() -> None:
    """Get ready, wait for the stage's run, write it; nothing when the stage ends without one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the stage's; its end closes the pipe
    registry.prepare()
    text = sys.stdin.read()
    if text:
        run = json.loads(text)
        curve = None if run["curve"] is None else Path(run["curve"])
        registry.log_run(**{**run, "curve": curve, "artifacts": [Path(name) for name in run["artifacts"]]})


if __name__ == "__main__":
    main()
