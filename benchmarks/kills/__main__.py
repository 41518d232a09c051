"""Kill everything once: `python -m benchmarks.kills --workspace runs/smoke --out kills.jsonl`.

Each cell takes a copy of a finished workspace of the loop (`make smoke` makes one), or a command of the library, hits
one process in one way, and asks: did it end, by itself and soon; is anything lost that was finished; is anything half
written; does anything still run; does the same command go on. It prints a table in Markdown and ends with status 1 if
something does not hold. Started again with the same file it goes on. Linux; full disks need root (a tmpfs is mounted).
"""

import argparse
import json
import os
import shutil
import tempfile
from dataclasses import asdict
from pathlib import Path

import psutil

from benchmarks.kills import command, loop
from benchmarks.kills.cell import Cell, Outcome


def main() -> int:
    """Run what is not in the file of results yet."""
    options = parser().parse_args()
    known = {outcome.cell: outcome for outcome in read(options.out)} if options.out.exists() else {}
    todo = [(cell, loop) for cell in loop.cells()] + [(cell, command) for cell in command.cells()]
    todo = [(cell, room) for cell, room in todo if options.only in cell.name and possible(cell)]
    with tempfile.TemporaryDirectory(prefix="bumblebee-kills-") as scratch:
        for number, (cell, room) in enumerate(todo, 1):
            if cell.name in known:
                continue
            print(f"{number}/{len(todo)} {cell.name}", flush=True)
            try:
                outcome = one(cell, room is loop, options.workspace.resolve(), Path(scratch))
            except (RuntimeError, psutil.NoSuchProcess) as error:
                print(f"  not tried: {error}", flush=True)
                continue
            known[cell.name] = outcome
            print(f"  {'; '.join(outcome.broken) or 'holds'} ({outcome.seconds} s: {outcome.said})", flush=True)
            if outcome.broken:
                kept = options.out.with_name(f"{options.out.stem}-{number}.log")
                shutil.copyfile(Path(scratch) / "log.txt", kept)
                print(f"  what was said: {kept}", flush=True)
            with options.out.open("a") as file:
                file.write(json.dumps(asdict(outcome)) + "\n")
    found = [known[cell.name] for cell, _ in todo if cell.name in known]
    print(table(found))
    return 1 if any(outcome.broken for outcome in found) or len(found) < len(todo) else 0


def one(cell: Cell, in_loop: bool, workspace: Path, scratch: Path) -> Outcome:
    """One cell of either kind."""
    return loop.run(cell, workspace, scratch) if in_loop else command.run(cell, scratch)


def possible(cell: Cell) -> bool:
    """Whether this user can try the cell."""
    return cell.how not in ("disk full", "read-only") or os.geteuid() == 0


def read(path: Path) -> list[Outcome]:
    """Outcomes of an earlier start."""
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    return [Outcome(**{key: tuple(v) if isinstance(v, list) else v for key, v in row.items()}) for row in rows]


def table(outcomes: list[Outcome]) -> str:
    """Markdown."""
    lines = ["| what is hit | while | how | ends after | status | again | holds |", "|---|---|---|---|---|---|---|"]
    for each in outcomes:
        target, stage, how = each.cell.split(" / ")
        verdict = "; ".join(each.broken) or "yes"
        lines.append(f"| {target} | {stage} | {how} | {each.seconds} s | {each.status} | {each.again} | {verdict} |")
    held = sum(not each.broken for each in outcomes)
    return "\n".join([*lines, "", f"{held} of {len(outcomes)} hold"])


def parser() -> argparse.ArgumentParser:
    """The command line."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.kills", description=__doc__)
    made.add_argument("--workspace", type=Path, default=Path("runs/smoke"), help="a finished workspace; only read")
    made.add_argument("--out", type=Path, default=Path("kills.jsonl"), help="file of results, gone on with")
    made.add_argument("--only", default="", help="cells whose name has this in it")
    return made


if __name__ == "__main__":
    raise SystemExit(main())
