"""Take the answer of `bumblebee gate` for a round: write it, and resume the run that waits for it.

The answer is written to data/approvals of the workspace; a run that waits for it on a reachable Prefect server is
resumed.
"""

import asyncio
import os
import sys
from pathlib import Path
from typing import Any

from flows import runs
from flows.environment import SERVERS, environment
from flows.people import login
from flows.servers import servers
from tasks.approvals import gate, words
from tasks.gate import asked, rule


def given(place: gate.Gate, verb: str, author: gate.Author, seen: str, note: str, change: bool) -> None:
    """Write an answer, say it, and resume the run that waits for it; see `gate.decide`."""
    asked(place)
    table = gate.decide(place, verb, author, seen, note, change, rule(place.workspace))
    where = f"round {place.round} of {place.workspace}"
    print(f"{where}: {words.said(table)}; it answers {words.what(table)}", flush=True)
    if table["status"] == "pending":
        return
    addresses = servers.running(place.workspace)
    resumed = addresses and resume(place.workspace, addresses.prefect, table)
    if table["status"] == "more":
        print(f"to go on {words.go_on(table)}")
    elif not resumed:
        print("start the loop again (or `dvc repro`): it goes on from here")


def resume(folder: Path, server: str, table: dict[str, Any]) -> list[str]:
    """Resume every run that is suspended at this round's gate; the names of those that go on."""
    os.environ.update(environment(folder))
    os.environ["PREFECT_API_URL"] = f"{server}/api"
    try:
        return asyncio.run(_resume(table))
    except Exception as error:  # the answer is written: whatever the server says, it stands
        said = words.one_line(f"{type(error).__name__}: {error}")[:200]
        print(f"Prefect could not resume a run ({said})", file=sys.stderr)
        return []


async def _resume(table: dict[str, Any]) -> list[str]:
    from prefect.client.orchestration import get_client
    from prefect.client.schemas.filters import FlowRunFilter
    from prefect.client.schemas.objects import StateType
    from prefect.client.schemas.responses import SetStateStatus

    values, resumed = filled(table), []
    async with get_client() as client:
        paused = FlowRunFilter.model_validate({"state": {"type": {"any_": [StateType.PAUSED.value]}}})
        for run in await client.read_flow_runs(flow_run_filter=paused):
            details = run.state.state_details if run.state else None
            if details and (details.pause_key or "").startswith(f"gate-{table['round']}-"):
                result = await client.resume_flow_run(run.id, run_input=values)
                if result.status == SetStateStatus.ACCEPT:
                    print(f"resumed on Prefect: {run.name}")
                    resumed.append(run.name)
                else:
                    reason = words.one_line(str(getattr(result.details, "reason", "")))
                    print(f"Prefect did not resume {run.name}: {reason}", file=sys.stderr)
    return resumed


def filled(table: dict[str, Any]) -> dict[str, str]:
    """Content of a run's form when this answer stands."""
    answer = next(verb for verb, status in gate.ANSWERS.items() if status == table["status"])
    return {"answer": answer, "by": table["by"], "seen": words.short(table), "note": table["note"]}


def resume_answered(folder: Path, server: str) -> list[str]:
    """Resume runs whose gate was answered while no server could be told; the names of those that go on."""
    stand = {}
    for path in sorted((folder / "data" / "measured").glob("r*/summary.json")):
        place = gate.Gate(folder.resolve(), int(path.parent.name.removeprefix("r")))
        if place.approval.exists() and (table := asked(place))["status"] != "pending":
            stand[f"gate-{place.round}-{words.short(table)}-"] = table
    password = login.read(folder / SERVERS)
    if not stand or password is None:
        return []
    resumed = []
    paused = {"flow_runs": {"state": {"type": {"any_": ["PAUSED"]}}}}
    for run in runs.ask(server, password, "flow_runs/filter", paused):
        key = str(run["state"]["state_details"].get("pause_key"))
        for table in (table for begin, table in stand.items() if key.startswith(begin)):
            told = runs.ask(server, password, f"flow_runs/{run['id']}/resume", {"run_input": filled(table)})
            resumed += [str(run["name"])] if told["status"] == "ACCEPT" else []
    for name in resumed:
        print(f"answered meanwhile, resumed: {name}", flush=True)
    return resumed
