"""Runs of the flow and the processes that they run in: what Prefect calls running must run."""

import json
import os
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from flows.people import login
from flows.processes import born, same

UNFINISHED = ["RUNNING", "PENDING", "CANCELLING"]  # a suspended run (PAUSED) has no process, and needs none
GONE = "the process of this run is gone (it was killed, or the machine went down); what its stages finished is kept"


@contextmanager
def recorded(folder: Path, run: str | None) -> Iterator[None]:
    """Write down, for the length of a block, that the flow run `run` runs in this process."""
    if not run:
        yield
        return
    (folder / "runs").mkdir(mode=0o700, parents=True, exist_ok=True)
    record = folder / "runs" / f"{run}.json"
    record.write_text(json.dumps({"pid": os.getpid(), "born": born(os.getpid())}))
    try:
        yield
    finally:
        record.unlink(missing_ok=True)


def runs_on(folder: Path, run: str) -> bool:
    """Whether the process that wrote the run's record still runs."""
    try:
        record = json.loads((folder / "runs" / f"{run}.json").read_text())
        return same(int(record["pid"]), float(record["born"]))
    except (OSError, ValueError, KeyError, TypeError):
        return False


def clear_lost(folder: Path, server: str, password: str, shared: bool = False) -> list[str]:
    """Set the runs and their stages to Crashed whose process is gone; the names of the runs.

    Call it before anybody knows the server's address: a run that is about to start has no record yet.

    Args:
        folder: with the records of the runs that began here.
        server: Prefect's.
        password: of its login.
        shared: whether runs of other machines stand in its database, too: those without a record here are left alone.
    """
    wanted = {"state": {"type": {"any_": UNFINISHED}}}
    lost = []
    for run in ask(server, password, "flow_runs/filter", {"flow_runs": wanted}):
        if runs_on(folder, run["id"]) or (shared and not (folder / "runs" / f"{run['id']}.json").exists()):
            continue
        stages = {"task_runs": wanted, "flow_runs": {"id": {"any_": [run["id"]]}}}
        for stage in ask(server, password, "task_runs/filter", stages):
            _crash(server, password, f"task_runs/{stage['id']}")
        _crash(server, password, f"flow_runs/{run['id']}")
        with suppress(OSError):
            (folder / "runs" / f"{run['id']}.json").unlink()
        lost.append(str(run["name"]))
    return lost


def _crash(server: str, password: str, which: str) -> None:
    state = {"type": "CRASHED", "name": "Crashed", "message": GONE}
    ask(server, password, f"{which}/set_state", {"state": state, "force": True})


def ask(server: str, password: str, what: str, body: dict[str, Any]) -> Any:
    """Answer of Prefect's interface; by hand, since Prefect itself reads its settings at its first import."""
    headers = {"Authorization": login.header(password), "Content-Type": "application/json"}
    asked = urllib.request.Request(f"{server}/api/{what}", json.dumps(body).encode(), headers)
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    with opener.open(asked, timeout=30) as reply:
        return json.loads(reply.read())
