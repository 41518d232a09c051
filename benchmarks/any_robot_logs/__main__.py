"""Random robots with random logs, diagnosed one by one: does it always end, and with a valid document?

    python -m benchmarks.any_robot_logs --out results.jsonl --workers 32 --limit 500
    python -m benchmarks.any_robot_logs --table results.jsonl

Each line of the results is a case: seed, what was drawn, outcome (done, refused with its line, traceback with its text,
aborted by a signal, too long), what is wrong with the document, effects named beside those sealed, time, memory. Seeds
that stand in the file are not run again. Cases run in processes of their own, so that an abort of MuJoCo ends one.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

HOME = Path(__file__).parents[2]
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def main(argv: list[str] | None = None) -> int:
    """Run what is not there yet; 0 only if every case ended as it should."""
    options = _options(argv)
    if options.child:
        return _child([int(s) for s in options.child.split(",")], options.quick)
    if options.table:
        print(table(read(options.table)))
        return 0
    done = {row["seed"] for row in read(options.out)}
    left = [s for s in range(options.first, options.first + options.limit) if s not in done]
    ends = time.monotonic() + options.seconds
    with ThreadPoolExecutor(options.workers) as pool, options.out.open("a") as out:
        running = [pool.submit(_timely, seed, options, ends) for seed in left]
        for future in as_completed(running):
            for row in future.result():
                out.write(json.dumps(row) + "\n")
                out.flush()
                print(brief(row), flush=True)
    rows = read(options.out)
    print(table(rows))
    return int(any(not is_well(row) for row in rows))


def _timely(seed: int, options: argparse.Namespace, ends: float) -> list[dict[str, Any]]:
    """The case, unless the time is over."""
    return [] if time.monotonic() > ends else list(run([seed], options.quick, options.each))


def run(seeds: Sequence[int], quick: bool, each: float) -> Iterator[dict[str, Any]]:
    """Rows of several cases in one process, and in another for those after one that ended it.

    A case may take `each` seconds on the mean.
    """
    left = list(seeds)
    while left:
        command = [sys.executable, "-X", "faulthandler", "-m", "benchmarks.any_robot_logs"]
        command += ["--child", ",".join(map(str, left))] + ["--quick"] * quick
        try:
            ended = subprocess.run(
                command, cwd=HOME, env=os.environ | ONE_THREAD, capture_output=True, text=True, timeout=each * len(left)
            )
            lines, reason = ended.stdout, f"aborted with status {ended.returncode}: {ended.stderr[-2000:]}"
        except subprocess.TimeoutExpired as late:
            lines, reason = (late.stdout or b"").decode(), f"too long: more than {each * len(left):.0f} s"
        rows = [json.loads(line) for line in lines.splitlines() if line.startswith('{"seed"')]
        yield from rows
        left = [seed for seed in left if seed not in {row["seed"] for row in rows}]
        if left:
            outcome = reason.split(" ", 1)[0].rstrip(":")
            yield {"seed": left.pop(0), "outcome": outcome, "text": reason, "problems": [], "seconds": None}


def _child(seeds: Sequence[int], quick: bool) -> int:
    """Run cases in this process, a line each."""
    import mujoco

    from benchmarks.any_robot_logs.case import FULL, QUICK, run_case
    from bumblebee.diagnosis.simulation import batches

    mujoco.set_mju_user_warning(lambda text: None)
    batches.THREADS = 1
    for seed in seeds:
        print(json.dumps(run_case(seed, QUICK if quick else FULL)), flush=True)
    return 0


def is_well(row: dict[str, Any]) -> bool:
    """Whether a case ended with a valid document, or with one line on unusable input."""
    if row["outcome"] == "refused":
        return bool(row["text"]) and "\n" not in row["text"]
    return row["outcome"] == "done" and not row["problems"]


def brief(row: dict[str, Any]) -> str:
    """One line for the terminal."""
    sealed = ", ".join(f"{s['effect']} {s['where']}" for s in row.get("sealed", [])) or "null"
    named = ", ".join(f"{e['effect']} {' '.join(e['where'])}" for e in row.get("named", [])) or "nothing"
    end = named if row["outcome"] == "done" else f"{row['outcome'].upper()} {row['text'].splitlines()[-1][:200]}"
    return f"{row['seed']:4d} [{row.get('about', '')}] {sealed} -> {end} {row['problems'] or ''} [{row['seconds']} s]"


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Counts of how the cases ended."""
    done = [r for r in rows if r["outcome"] == "done"]
    one, none = ([r for r in done if len(r["sealed"]) == n] for n in (1, 0))
    seconds = sorted(r["seconds"] for r in done)
    counts = {o: sum(r["outcome"] == o for r in rows) for o in dict.fromkeys(r["outcome"] for r in rows)}
    lines = [
        f"{len(rows)} cases: {', '.join(f'{n} {o}' for o, n in counts.items())}; not well "
        f"{sum(not is_well(r) for r in rows)}",
        f"invalid documents: {sum(bool(r['problems']) for r in done)}; with models or steps that failed: "
        f"{sum(bool(r['failures']) for r in done)}",
        f"one sealed effect: first in {sum(r['first_is_sealed'] for r in one)} of {len(one)}",
        f"nothing sealed: effects named, beside the encoders' steps of quantised logs, in "
        f"{sum(r['beside_steps'] > 0 for r in none)} of {len(none)}",
        f"unexplained significant: {sum(r['unexplained'] for r in done)} of {len(done)}, of nulls "
        f"{sum(r['unexplained'] for r in none)} of {len(none)}",
    ]
    if seconds:
        middle, high = seconds[len(seconds) // 2], seconds[int(0.95 * (len(seconds) - 1))]
        peak = max(r["peak_mb"] for r in done)
        lines.append(f"seconds: median {middle:.0f}, 95 % {high:.0f}, most {seconds[-1]:.0f}; peak {peak} MB")
    lines += [f"{r['seed']}: {note}" for r in done for note in r["failures"]]
    return "\n".join(lines + [brief(r) for r in rows if not is_well(r)])


def read(path: Path) -> list[dict[str, Any]]:
    """Rows of a file of results; a line that a kill cut short is left out."""
    rows = []
    for line in path.read_text().splitlines() if path.is_file() else []:
        try:
            rows.append(json.loads(line))
        except ValueError:
            continue
    return rows


def _options(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.any_robot_logs", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    parser.add_argument("--out", type=Path, default=Path("results.jsonl"), help="file of results, appended to")
    parser.add_argument("--workers", type=int, default=1, help="cases side by side, one core each")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--limit", type=int, default=500, help="seeds from there on")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="begin no case after this long")
    parser.add_argument("--each", type=float, default=1800.0, help="seconds that one case may take")
    parser.add_argument("--quick", action="store_true", help="small robots and logs, searched for less than a second")
    parser.add_argument("--table", type=Path, help="print the counts of a file of results and end")
    parser.add_argument("--child", help=argparse.SUPPRESS)
    return parser.parse_args(argv)


if __name__ == "__main__":
    raise SystemExit(main())
