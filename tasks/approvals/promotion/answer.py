"""Look at what stage publish proposes, and answer it: what `bumblebee gate` does where it is given a model's name."""

from contextlib import chdir
from pathlib import Path
from typing import Any

from tasks.approvals import gate, words
from tasks.approvals.promotion.gate import Promotion, require_as_shown, require_no_champion, settle
from tasks.publish import PublishConfig
from tasks.settings.params import load


def rule(workspace: Path) -> gate.GateConfig:
    """How promotions of this workspace are answered."""
    return load("publish", PublishConfig, workspace / "params.yaml").promotion


def asked(place: Promotion) -> dict[str, Any]:
    """The request with its answer, if one stands by the workspace's rule."""
    return gate.request(place, False, rule(place.workspace).people)


def given(place: Promotion, verb: str, author: gate.Author, seen: str, note: str, change: bool) -> None:
    """Take an answer, move the alias where it was the last that was needed, and say so."""
    own = rule(place.workspace)
    table = gate.request(place, False, own.people)
    with chdir(place.workspace):
        if verb == "approve":
            require_as_shown(table)
        else:
            require_no_champion(table)
        if verb == "approve" and table["status"] == "approved" and not change and settle(place, table):
            return  # approved before, by a process that ended before the alias moved
        table = gate.decide(place, verb, author, seen, note, change, own)
        print(f"{words.title(table)} in {place.workspace}: {words.said(table)}; it answers {words.what(table)}")
        if table["status"] == "more":
            print(f"to go on {words.go_on(table)}")
        settle(place, table)


def show(table: dict[str, Any], place: Promotion) -> None:
    """Print what is proposed, who answered, and the commands that answer."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    seen = table["seen"]
    grid = Table(title=f"Promotion of {place.model}: {table['status']}", show_header=False)
    rows = {"version": seen["version"], "policy": seen["policy"], "policy.onnx, sha256": seen["onnx_sha256"][:12]}
    rows |= {"evaluated on": seen["engine"], "why": seen["reason"]}
    rows |= {name: seen[name] for name in ("success", "success_ci95", "mpjpe_rad", "mpkpe_mm")}
    rows |= {"champion until now": seen["champion"] or "none", "hash of what is seen": words.short(table)}
    rows |= {"answer": words.said(table) if "by" in table or table.get("approvals") else "none yet"}
    for number, old in enumerate(table["history"], 1):
        rows[f"earlier answer {number}"] = f"{words.said(old)}; it answered {words.what({**table, **old})}"
    for name, value in rows.items():
        grid.add_row(name, escape(str(value)))
    Console().print(grid)
    change = "" if table["status"] == "pending" else " --change"
    for verb in gate.ANSWERS:
        print(f"to answer {verb}: {words.answer_command(place.workspace, table, verb)}{change}")
    if table["status"] == "more":
        print(f"to go on: {words.go_on(table)}")
