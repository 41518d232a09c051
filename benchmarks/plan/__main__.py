"""Worth of planned runs on sealed robots, with random motions of equal length beside them.

    python -m benchmarks.plan --out results.jsonl --workers 32 --limit 120
    python -m benchmarks.plan --table results.jsonl

A poor dataset of a sealed arm is diagnosed; where that leaves the class open (the true effect is not first, or
others are `equivalent` to it), runs are planned, flown by the sealed arm and diagnosed together with the poor ones.
One line of JSON a case; cases that the file already holds are skipped, so a run that was killed goes on.
"""

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.undeclared.__main__ import _plain, _quiet, commit, read_lines
from benchmarks.undeclared.stats import wilson
from bumblebee.errors import EXIT_BAD_INPUT, BadInput


def main(argv: list[str] | None = None) -> int:
    """Run or tabulate; returns the exit status."""
    options = _options(argv)
    try:
        if options.table:
            print(table([row for path in options.table for row in read_lines(path)]))
            return 0
        run(options)
    except BadInput as error:
        print(error, file=sys.stderr)
        return EXIT_BAD_INPUT
    return 0


def run(options: argparse.Namespace) -> None:
    """Cases that are not in the file yet."""
    from benchmarks.plan.case import cases

    done = {row["case"] for row in read_lines(options.out)} if options.out.exists() else set()
    every = [case for case in cases(options.seed, options.cases) if case.number not in done]
    left = [c for c in every if not options.only or {c.kind, c.poor, str(c.number)} & set(options.only.split(","))]
    gains = {name: tuple(float(x) for x in getattr(options, name).split(",") if x) for name in ("gains", "damping")}
    left = [replace(case, **gains) for case in left[: options.limit]]
    stamp = {"seed": options.seed, "commit": commit()}
    print(f"{len(left)} cases", flush=True)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    with options.out.open("a") as out, ProcessPoolExecutor(options.workers, initializer=_quiet) as pool:
        for future in as_completed([pool.submit(partial(_one, case, options.seed)) for case in left]):
            row = future.result()
            out.write(json.dumps(stamp | row, default=_plain) + "\n")
            out.flush()
            print(brief(row), flush=True)


def _one(case: Any, seed: int) -> dict[str, Any]:
    from benchmarks.plan.case import run_case

    return run_case(case, seed)


def brief(row: dict[str, Any]) -> str:
    """One line for the terminal."""
    where = f"{row['case']:4d} {row['kind']} {row['poor']} [{row['seconds']:.0f} s]"
    if "failed" in row or "skipped" in row:
        return f"{where}: {row.get('failed') or row['skipped']}"
    told = [
        f"{name} {'resolved' if row[name]['resolved'] else 'open'} ({', '.join(row[name]['named'][:3]) or 'nothing'}; "
        f"{row[name]['class']})"
        for name in ("before", "planned", "random")
    ]
    return f"{where} {' '.join(row['truth']['where'])}: {' | '.join(told)}"


def table(rows: list[dict[str, Any]]) -> str:
    """Shares with Wilson's intervals, planned and random side by side, and how many cases there were."""
    open_ = [row for row in rows if "planned" in row and "random" in row]
    lines = [
        f"{len(rows)} cases: {sum('skipped' in r for r in rows)} resolved by the poor data, "
        f"{sum('failed' in r for r in rows)} failed, {len(open_)} open",
        f"{'':44s} {'planned':>26s} {'random':>26s}",
    ]
    for key, text in (
        ("resolved", "named first, nothing equivalent"),
        ("smaller", "named first, class empty or smaller"),
        ("first", "named first"),
        ("covered", "interval covers"),
    ):
        lines.append(f"{text:44s} {_share(open_, 'planned', key):>26s} {_share(open_, 'random', key):>26s}")
    lines.append(f"{'width after / before, median':44s} {_ratio(open_, 'planned'):>26s} {_ratio(open_, 'random'):>26s}")
    kept = [max(r["kept_planned"].values()) for r in open_ if "kept_planned" in r]
    if kept:
        lines.append(f"limits kept by the true robot: {sum(k <= 1 / 0.9 for k in kept)} of {len(kept)} plans")
    seconds = [row["seconds"] for row in open_]
    if seconds:
        lines.append(f"a case: median {np.median(seconds):.0f} s, longest {max(seconds):.0f} s")
    return "\n".join(lines)


def _share(rows: list[dict[str, Any]], name: str, key: str) -> str:
    values = [bool(row[name][key]) for row in rows if row[name][key] is not None]
    if not values:
        return "-"
    low, high = wilson(sum(values), len(values))
    return f"{sum(values)}/{len(values)} {100 * np.mean(values):.0f} % [{100 * low:.0f}, {100 * high:.0f}]"


def _ratio(rows: list[dict[str, Any]], name: str) -> str:
    pairs = [(row["before"]["width"], row[name]["width"]) for row in rows]
    ratios = [after / before for before, after in pairs if before and after]
    return f"{np.median(ratios):.3g} ({len(ratios)})" if ratios else "-"


def _options(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.plan", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("plan.jsonl"), help="file of results, appended to")
    parser.add_argument("--seed", type=int, default=1, help="of the cases")
    parser.add_argument("--cases", type=int, default=200, help="length of the list of cases")
    parser.add_argument("--workers", type=int, default=1, help="processes, one core each")
    parser.add_argument("--limit", type=int, default=None, help="cases at most")
    parser.add_argument("--gains", default="1", help="factors on kp that planned runs may have, as 0.6,1")
    parser.add_argument("--damping", default="", help="factors on kd that planned runs may have besides, as 0.5")
    parser.add_argument("--only", metavar="A,B", help="kinds, poor datasets or case numbers")
    parser.add_argument("--table", type=Path, nargs="+", metavar="FILE", help="print the table of results and end")
    return parser.parse_args(argv)


if __name__ == "__main__":
    raise SystemExit(main())
