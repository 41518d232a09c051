"""Let a round pass when a person has approved what the ingest stage showed; also the command that answers."""

import argparse
import sys
from pathlib import Path
from typing import Any

from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.measured import gate
from tasks.stage import load, run_stage

EXIT_PENDING, EXIT_REJECTED = 3, 4


def approval_path(round: int) -> Path:
    """Where the request and its answer lie."""
    return Path(f"data/approvals/round-{round}.json")


def summary_path(round: int) -> Path:
    """What the ingest stage showed."""
    return Path(f"data/measured/r{round}/summary.json")


def main(round: int) -> None:
    """Write data/gates/round-N.json if the answer is yes; end with status 3 (no answer yet) or 4 (rejected)."""
    path, passed = approval_path(round), Path(f"data/gates/round-{round}.json")
    passed.unlink(missing_ok=True)
    table = gate.request(path, round, summary_path(round))
    if table["status"] == "pending" and load("gate", gate.GateConfig).mode == "auto":
        table = gate.answer(path, True, gate.AUTOMATIC)
    if table["status"] == "pending":
        print(gate.how_to_answer(round), file=sys.stderr, flush=True)
        raise SystemExit(EXIT_PENDING)
    if table["status"] == "rejected":
        note = f": {table['note']}" if table.get("note") else ""
        line = f"round {round} was rejected by {table['by']} at {table['at']}{note}"
        print(" ".join(line.split()), file=sys.stderr, flush=True)
        raise SystemExit(EXIT_REJECTED)
    keys = ("round", "status", "by", "at", "note", "seen")
    gate.write_json(passed, {key: table[key] for key in keys})
    print(f"round {round}: approved by {table['by']} at {table['at']}", flush=True)


def command(argv: list[str]) -> int:
    """`--show`, `--approve` and `--reject`."""
    options = _parse(argv)
    path, summary = approval_path(options.round), summary_path(options.round)
    try:
        table = gate.request(path, options.round, summary)
        if options.approve or options.reject:
            if not options.by:
                raise BadInput("tasks.gate", "--by NAME, who answers", "no name")
            gate.require_seen(table, options.seen)
            table = gate.answer(path, options.approve, options.by, options.note)
            then = " Run `dvc repro` to go on." if options.approve else ""
            print(f"round {options.round}: {table['status']} by {table['by']}: {gate.what(table)}.{then}")
        else:
            show(table, summary.parent)
    except BadInput as error:
        print(error, file=sys.stderr)
        return EXIT_BAD_INPUT
    return 0


def show(table: dict[str, Any], folder: Path) -> None:
    """Print what came, as tables, and where the plots are."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    seen, console = table["seen"], Console()
    grid = Table(title=f"Round {table['round']}: {table['status']}", show_header=False)
    who = f"{table['by']} at {table['at']} {table['note']}" if "by" in table else "nobody yet"
    rows = {"files accepted": seen["accepted"], "files set aside": seen["quarantined"]}
    rows |= {"hash of what is seen": gate.short(table)}
    rows |= {"seconds accepted": f"{seen['seconds']:.1f}", "answered by": who}
    for name, value in rows.items():
        grid.add_row(name, escape(str(value)))
    console.print(grid)
    rules = Table("rule", "files", "fatal", "warning", title="Findings" if seen["findings"] else "No findings")
    for rule, counts in seen["findings"].items():
        rules.add_row(escape(rule), *(str(counts[key]) for key in ("files", "fatal", "warning")))
    console.print(rules)
    console.print(f"plots: {folder / 'overview.html'}\nfindings: {folder / 'findings.csv'}", soft_wrap=True)
    if table["status"] == "pending":
        console.print(gate.how_to_answer(table["round"]), soft_wrap=True, markup=False)
        console.print(f"to answer this and nothing else, add: --seen {gate.short(table)}", soft_wrap=True)


def _parse(argv: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tasks.gate", description=__doc__)
    parser.add_argument("--round", type=int, required=True, help="the round that is meant")
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument("--show", action="store_true", help="print what came and where the plots are")
    choice.add_argument("--approve", action="store_true", help="let the round go on")
    choice.add_argument("--reject", action="store_true", help="stop the round")
    parser.add_argument("--by", default="", help="who answers")
    parser.add_argument("--seen", default="", help="the hash that --show printed: refuse if something else lies there")
    parser.add_argument("--note", default="", help="why")
    return parser.parse_args(argv)


if __name__ == "__main__":
    if {"--show", "--approve", "--reject", "--help", "-h"} & set(sys.argv[1:]):
        raise SystemExit(command(sys.argv[1:]))
    run_stage(main, logs=False)
