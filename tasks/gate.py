"""Let a round pass when a person has approved what the ingest stage showed."""

import sys
from pathlib import Path
from typing import Any

from tasks.approvals import gate, words
from tasks.running import paths
from tasks.running.stage import log_run, run_stage
from tasks.settings.params import load

EXIT_PENDING, EXIT_REJECTED = 3, 4
TO_ANSWER = {verb: f"to {verb} this and nothing else" for verb in ("approve", "reject")}
TO_ANSWER["more"] = "to ask for more rollouts than these"
KEPT = ("round", "status", "by", "known_by", "at", "note", "seen", "approvals")  # of an answer, in data/gates


def main(round: int) -> None:
    """Write data/gates/round-N.json if the answer is yes; end with status 3 (it waits) or 4 (rejected)."""
    place, passed = gate.Gate(Path.cwd(), round), paths.gate(round)
    passed.unlink(missing_ok=True)
    own = rule()
    table = gate.settle(place, own.mode == "auto", own.people)
    if table["status"] in gate.WAITS:
        print(words.how_to_answer(place.workspace, table), file=sys.stderr, flush=True)
        raise SystemExit(EXIT_PENDING)
    line = f"round {round}: {words.said(table)}"
    if table["status"] == "rejected":
        print(line, file=sys.stderr, flush=True)
        raise SystemExit(EXIT_REJECTED)
    gate.write_json(passed, {key: table[key] for key in KEPT if key in table})
    print(line, flush=True)
    log_run("gate", round=round, params=own, tags={"status": table["status"]})


def rule(workspace: Path = Path()) -> gate.GateConfig:
    """How the gates of this workspace are answered."""
    return load("gate", gate.GateConfig, workspace / "params.yaml")


def asked(place: gate.Gate) -> dict[str, Any]:
    """The request of a round with its answer, if one stands by the workspace's rule."""
    own = rule(place.workspace)
    return gate.request(place, own.mode == "auto", own.people)


def show(table: dict[str, Any], place: gate.Gate) -> None:
    """Print what came, as tables, where the plots are, who answered, and the commands that answer."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    seen, console, folder = table["seen"], Console(), place.summary.parent
    grid = Table(title=f"Round {table['round']}: {table['status']}", show_header=False)
    rows = {"files accepted": seen["accepted"], "files set aside": seen["quarantined"]}
    rows |= {"seconds accepted": f"{seen['seconds']:.1f}", "hash of what is seen": words.short(table)}
    rows |= {"answer": words.said(table) if "by" in table or table.get("approvals") else "none yet"}
    for number, old in enumerate(table["history"], 1):
        rows[f"earlier answer {number}"] = f"{words.said(old)}; it answered {words.what(old)}"
    for name, value in rows.items():
        grid.add_row(name, escape(str(value)))
    console.print(grid)
    rules = Table("rule", "files", "fatal", "warning", title="Findings" if seen["findings"] else "No findings")
    for rule, counts in seen["findings"].items():
        rules.add_row(escape(rule), *(str(counts[key]) for key in ("files", "fatal", "warning")))
    console.print(rules)
    print(f"the page with the plots: {folder / 'overview.html'}\nevery finding: {folder / 'findings.csv'}")
    change = "" if table["status"] == "pending" else " --change"
    for verb, what in TO_ANSWER.items():
        print(f"{what}: {words.answer_command(place.workspace, table, verb)}{change}")
    if table["status"] == "more":
        print(f"to go on: {words.go_on(table)}, and of everybody")


if __name__ == "__main__":
    run_stage(main)
