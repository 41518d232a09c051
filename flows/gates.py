"""A gate in the flow: show what came, wait for a person, write down the answer."""

from pathlib import Path
from typing import Any

from prefect import runtime, suspend_flow_run
from prefect.artifacts import create_markdown_artifact
from prefect.input import RunInput
from pydantic import Field

from bumblebee.measured import gate
from flows.stages import Stage
from tasks.params import read


class GateAnswer(RunInput):
    """What a person answers on Prefect's page."""

    approve: bool = Field(default=True, description="On: the round goes on. Off: it stops here.")
    by: str = Field(description="Who answers.")
    note: str = Field(default="", description="Why, if there is something to say.")


def hold(folder: Path, stage: Stage) -> str | None:
    """Ask at a gate whose round has come in; None when the gate stage can run (it passes, or says who rejected).

    A run that Prefect started as a deployment is suspended: its process ends, the question stands on Prefect's page,
    and the answer starts it again, after any restart. Any other run gets the line that says how to answer, to end with.
    """
    number = int(stage.option("round") or 0)
    approval = folder / "data" / "approvals" / f"round-{number}.json"
    summary = folder / "data" / "measured" / f"r{number}" / "summary.json"
    if not summary.exists() or gate.verdict(approval, summary) != "pending" or automatic(folder):
        return None
    request = gate.request(approval, number, summary)
    text = question(request, folder)
    create_markdown_artifact(text, key=f"gate-round-{number}", description=f"What came in round {number}")
    if runtime.deployment.id is None:
        return f"{gate.how_to_answer(number)}; then start again, it goes on from here"
    model = GateAnswer.with_initial_data(description=text)
    key = f"gate-{number}-{request['seen']['sha256'][:12]}"
    given: Any = suspend_flow_run(wait_for_input=model, timeout=None, key=key)
    gate.answer(approval, given.approve, given.by, given.note)
    return None


def automatic(folder: Path) -> bool:
    """Whether the gates answer themselves here."""
    section = read(folder / "params.yaml").get("gate") or {}
    return bool(section.get("mode") == "auto")


def question(request: dict[str, Any], folder: Path) -> str:
    """Markdown: what came, what was found, where the plots are."""
    seen, number = request["seen"], request["round"]
    rows = [("files accepted", seen["accepted"]), ("files set aside", seen["quarantined"])]
    rows.append(("seconds accepted", f"{seen['seconds']:.1f}"))
    lines = [f"## Round {number}: measured rollouts have come in", "", "| what | how many |", "|---|---|"]
    lines += [f"| {name} | {value} |" for name, value in rows]
    if seen["findings"]:
        lines += ["", "| finding | files | fatal | warning |", "|---|---|---|---|"]
        lines += [f"| {rule} | {n['files']} | {n['fatal']} | {n['warning']} |" for rule, n in seen["findings"].items()]
    else:
        lines += ["", "No findings."]
    plots = folder / "data" / "measured" / f"r{number}" / "overview.html"
    lines += ["", f"Plots: `{plots}`", "", "Approve, and the diagnosis learns from these files."]
    return "\n".join(lines)
