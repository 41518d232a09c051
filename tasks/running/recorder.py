"""A process beside a stage that has MLflow ready by the time the stage has something to log.

MLflow takes seconds to import; here it does so on another core while the stage works.
"""

import json
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput
from tasks import registry
from tasks.running.run_form import flatten

# How drivers and clients say that a lab's PostgreSQL or S3 does not answer, under whatever MLflow makes of it.
AWAY = re.compile(
    r"EndpointConnectionError|ConnectTimeoutError|ReadTimeoutError|ConnectionClosedError|psycopg2\.OperationalError|"
    r"Could not connect to the endpoint|Connection refused|server closed the connection|"
    r"the database system is (starting up|shutting down)"
)
_BEGUN = time.time()  # the stage's modules are the first that its process imports
_started: list[subprocess.Popen[str]] = []


def start() -> None:
    """Start the process; it ends by itself with this one."""
    command = [sys.executable, "-m", "tasks.running.recorder"]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    _started.append(process)


def record(run: dict[str, Any]) -> None:
    """Write one finished run through the process that was started, or here where none was.

    Args:
        run: the arguments of `registry.log_run`.

    Raises:
        BadInput: where a lab's database or store does not answer.
        OSError: where a file could not be read or written, as it came up there.
        RuntimeError: with MLflow's words, where the run could not be written for another reason.
    """
    run = {**run, "begun": _BEGUN}
    if not _started:
        registry.log_run(**run)
        return
    process = _started.pop()
    _, said = process.communicate(json.dumps(_plain(run)))
    if process.returncode:
        raise heard(said)


def told(error: Exception) -> str:
    """An error as one line for the other process."""
    text = " ".join(str(error).split())
    facts = {"type": type(error).__name__, "text": text, "errno": getattr(error, "errno", None)}
    if isinstance(error, BadInput):
        facts["parts"] = (error.where, error.expected, error.came, error.do)
    return json.dumps({**facts, "file": str(getattr(error, "filename", None) or "")})


def heard(said: str) -> Exception:
    """The error that the last line of `said` tells, whole: its number and file decide what the user reads."""
    last = (said.strip().splitlines() or ["the recorder ended without a word"])[-1]
    try:
        facts = json.loads(last)
    except ValueError:
        return RuntimeError(last)
    if "parts" in facts:
        return BadInput(*facts["parts"])
    if facts["errno"] is not None:
        return OSError(facts["errno"], facts["text"], facts["file"] or None)
    text = f"{facts['type']}: {facts['text']}"
    return away(text) or RuntimeError(text)


def away(text: str) -> BadInput | None:
    """The one line for a lab's database or store that does not answer; None where the text tells of another error."""
    if not AWAY.search(text):
        return None
    do = "What the stage made is not kept without it: start again when they answer."
    return BadInput("MLflow's record of the stage", "the lab's database and store to answer", text[:300], do)


def _plain(run: dict[str, Any]) -> dict[str, Any]:
    """The run in what JSON knows."""
    curve = None if run["curve"] is None else str(run["curve"])
    return {**run, "params": flatten(run["params"]), "curve": curve}


def main() -> int:
    """Get ready, wait for the stage's run, write it; nothing when the stage ends without one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the stage's; its end closes the pipe
    try:
        registry.prepare()
        text = sys.stdin.read()
        if text:
            run = json.loads(text)
            curve = None if run["curve"] is None else Path(run["curve"])
            registry.log_run(**{**run, "curve": curve})
    except Exception as error:  # every one is the stage's, which says it in its own way
        print(told(error), file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
