"""Answer a gate from any terminal: `python -m flows.gate approve --round 1 --by NAME`.

The answer is written to data/approvals; a run that waits for it on a reachable Prefect server is resumed.
"""

import argparse
import asyncio
import os
import sys
from pathlib import Path
from typing import Any

from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.measured import gate
from flows import servers
from flows import workspace as workspaces
from flows.environment import environment


def main(argv: list[str] | None = None) -> int:
    """Write the answer; resume the run that waits for it."""
    options = parser().parse_args(argv)
    try:
        folder = workspaces.named(options.name)
        approval = folder / "data" / "approvals" / f"round-{options.round}.json"
        summary = folder / "data" / "measured" / f"r{options.round}" / "summary.json"
        gate.require_seen(gate.request(approval, options.round, summary), options.seen)
        table = gate.answer(approval, options.answer == "approve", options.by, options.note)
    except BadInput as error:
        print(error, file=sys.stderr)
        return EXIT_BAD_INPUT
    print(f"round {options.round}: {table['status']} by {table['by']}: {gate.what(table)}")
    addresses = servers.running(folder)
    resumed = resume(folder, addresses.prefect, options.round, table) if addresses else []
    if resumed:
        print(f"resumed on Prefect: {', '.join(resumed)}")
    else:
        print("start the loop again (or `dvc repro`): it goes on from here")
    return 0


def parser() -> argparse.ArgumentParser:
    """The command line."""
    made = argparse.ArgumentParser(prog="python -m flows.gate", description=__doc__)
    made.add_argument("answer", choices=["approve", "reject"])
    made.add_argument("--round", type=int, required=True, help="the round that is meant")
    made.add_argument("--by", required=True, help="who answers")
    made.add_argument("--seen", default="", help="the hash that `python -m tasks.gate --round N --show` printed")
    made.add_argument("--note", default="", help="why")
    made.add_argument("--name", default="", help="workspace under runs/; by default this folder, or the checkout")
    return made


def resume(folder: Path, server: str, number: int, table: dict[str, Any]) -> list[str]:
    """Resume every run that is suspended at this round's gate; their names."""
    os.environ.update(environment(folder))
    os.environ["PREFECT_API_URL"] = f"{server}/api"
    return asyncio.run(_resume(number, table))


async def _resume(number: int, table: dict[str, Any]) -> list[str]:
    from prefect.client.orchestration import get_client
    from prefect.client.schemas.filters import FlowRunFilter
    from prefect.client.schemas.objects import StateType

    values = {"approve": table["status"] == "approved", "by": table["by"], "note": table["note"]}
    resumed = []
    async with get_client() as client:
        paused = FlowRunFilter.model_validate({"state": {"type": {"any_": [StateType.PAUSED.value]}}})
        for run in await client.read_flow_runs(flow_run_filter=paused):
            details = run.state.state_details if run.state else None
            if details and (details.pause_key or "").startswith(f"gate-{number}-"):
                await client.resume_flow_run(run.id, run_input=values)
                resumed.append(run.name)
    return resumed


if __name__ == "__main__":
    raise SystemExit(main())
