"""Command line of the sealed benchmark.

    python -m benchmarks.undeclared --out results.jsonl --workers 2 --limit 20
    python -m benchmarks.undeclared --out results.jsonl --only single --only arm
    python -m benchmarks.undeclared --table results.jsonl
    python -m benchmarks.undeclared --list

One line of JSON a case is appended as it is done; cases that the file already holds are skipped, so a run that was
killed goes on where it stopped.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.undeclared.lottery import VERSION, Case, Suite
from bumblebee.errors import EXIT_BAD_INPUT, BadInput

_ROBOTS = ("arm", "stand", "track")


def main(argv: list[str] | None = None) -> int:
    """Run, list or tabulate; returns the exit status."""
    options = _options(argv)
    try:
        if options.table:
            from benchmarks.undeclared.table import table

            print(table([row for path in options.table for row in read_lines(path)]))
            return 0
        suite = Suite(options.seed)
        cases = [case for case in suite.cases() if chosen(case, options)]
        with_rivals = options.rivals.split(",")
        if unknown := set(with_rivals) - {"", *_ROBOTS}:
            raise BadInput("--rivals", f"some of {', '.join(_ROBOTS)}", ", ".join(sorted(unknown)))
        cases = [replace(case, rivals=case.rivals and case.robot in with_rivals) for case in cases]
        if options.policy is not None and not (options.policy / "policy.onnx").is_file():
            raise BadInput(options.policy, "a folder with policy.onnx and contract.json", "none there")
        if options.policy is None and not options.list:
            print("no --policy: the G1 that tracks motions is left out")
            cases = [case for case in cases if case.robot != "track"]
        print(f"suite version {VERSION}, seed {options.seed}, sha256 {suite.digest()}: {len(cases)} cases", flush=True)
        if options.list:
            for case in cases:
                print(case)
            return 0
        run(cases, options, suite)
    except BadInput as error:
        print(error, file=sys.stderr)
        return EXIT_BAD_INPUT
    return 0


def run(cases: list[Case], options: argparse.Namespace, suite: Suite) -> None:
    """Cases that are not in the file yet: in the suite's order until the time is over, or all, the longest first."""
    ends = time.monotonic() + options.seconds
    done = {row["case"] for row in read_lines(options.out)} if options.out.exists() else set()
    if options.skip:
        done |= {row["case"] for path in options.skip for row in read_lines(path)}
    left = [case for case in cases if case.number not in done][: options.limit]
    if not np.isfinite(options.seconds):
        left.sort(key=_Durations().of, reverse=True)
    stamp = {"version": VERSION, "seed": suite.seed, "suite": suite.digest(), "commit": commit()}
    options.out.parent.mkdir(parents=True, exist_ok=True)
    with options.out.open("a") as out, ProcessPoolExecutor(options.workers, initializer=_quiet) as pool:
        for row in _rows(pool, left, suite.seed, options.policy, options.workers, ends):
            out.write(json.dumps(stamp | row, default=_plain) + "\n")
            out.flush()
            print(brief(row), flush=True)
        pool.shutdown(wait=False, cancel_futures=True)
        if time.monotonic() >= ends:
            for process in list((pool._processes or {}).values()):
                process.terminate()


def _rows(
    pool: ProcessPoolExecutor, left: list[Case], seed: int, policy: Path | None, workers: int, ends: float
) -> Iterator[dict[str, Any]]:
    """Results as they come; no case is begun that would not end in time, and what is unfinished then is dropped."""
    running: dict[Future, Case] = {}
    taken = _Durations()
    while True:
        room = ends - time.monotonic()
        while len(running) < workers and (case := taken.first(left, room)) is not None:
            left.remove(case)
            running[pool.submit(_one, case, seed, policy)] = case
        if not running or room <= 0:
            return
        finished, _ = wait(running, timeout=max(0.1, min(5.0, room)), return_when=FIRST_COMPLETED)
        for future in finished:
            row = future.result()
            taken.add(running.pop(future), row["seconds"])
            yield row


class _Durations:
    """How long cases take, learned as they are done."""

    def __init__(self) -> None:
        self._seconds = {"arm": [30.0], "stand": [150.0], "track": [150.0]}

    def add(self, case: Case, seconds: float) -> None:
        """Learn from one."""
        self._seconds[case.robot].append(seconds / self._work(case))

    def first(self, cases: list[Case], room: float) -> Case | None:
        """The first case that should end within `room` seconds."""
        return next((c for c in cases if 1.3 * self.of(c) < room), None)

    def of(self, case: Case) -> float:
        """Seconds that one may take."""
        return float(np.mean(self._seconds[case.robot]) * self._work(case))

    def _work(self, case: Case) -> float:
        return (case.rollouts + 3) / 7 * (2.0 if case.rivals else 1.0)


def _one(case: Case, seed: int, policy: Path | None) -> dict[str, Any]:
    from benchmarks.undeclared.case import run_case

    began = time.monotonic()
    row = run_case(case, seed, policy)
    return row | {"seconds": round(time.monotonic() - began, 2)}


def _quiet() -> None:
    """One thread a process, and no log of robots that fly apart."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"
    import mujoco

    from bumblebee.diagnosis.simulation import batches

    mujoco.set_mju_user_warning(lambda text: None)
    batches.THREADS = 1


def read_lines(path: Path) -> list[dict[str, Any]]:
    """Rows of a results file; a last line that a kill cut short is left out."""
    path = Path(path)
    if not path.is_file():
        raise BadInput(path, "a file of results", "no such file")
    rows = []
    lines = path.read_text().splitlines()
    for number, line in enumerate(lines, 1):
        try:
            rows.append(json.loads(line))
        except ValueError:
            if number < len(lines):
                raise BadInput(f"{path}: line {number}", "a JSON object", line[:60]) from None
    return rows


def chosen(case: Case, options: argparse.Namespace) -> bool:
    """Whether a case is of the kinds, robots and groups asked for."""
    words = {case.robot, case.group, *case.kinds, str(case.number)}
    return all(set(only.split(",")) & words for only in options.only)


def brief(row: dict[str, Any]) -> str:
    """One line for the terminal."""
    truth = ", ".join(f"{t['effect']} {' '.join(t['where'])} x{t['ratio']:.1f}" for t in row.get("truth", [])) or "null"
    got = row.get("failed") or row.get("skipped") or ", ".join(row["ours"]["named"]) or "nothing"
    where = f"{row['case']:4d} {row['robot']} n{row['noise']:g} r{row['rollouts']}"
    return f"{where}: {truth} -> {got} [{row['seconds']:.0f} s]"


def commit() -> str:
    """The checkout's commit, with a plus where files differ from it; "unknown" outside a checkout."""
    here = Path(__file__).parent
    try:
        head = subprocess.run(
            ["git", "rev-parse", "--short", "HEAD"], cwd=here, capture_output=True, text=True, check=True
        )
        dirty = subprocess.run(
            ["git", "status", "--porcelain", "--", "../../bumblebee"],
            cwd=here,
            capture_output=True,
            text=True,
            check=True,
        )
    except (OSError, subprocess.CalledProcessError):
        return os.environ.get("BENCHMARK_COMMIT", "unknown")
    return head.stdout.strip() + ("+" if dirty.stdout.strip() else "")


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    return value.tolist() if hasattr(value, "tolist") else str(value)


def _options(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.undeclared",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--out", type=Path, default=Path("results.jsonl"), help="file of results, appended to")
    parser.add_argument("--skip", type=Path, nargs="*", help="other files of results whose cases are not run again")
    parser.add_argument("--seed", type=int, default=1, help="of the suite")
    parser.add_argument("--workers", type=int, default=1, help="processes, one core each")
    parser.add_argument("--only", action="append", default=[], metavar="A,B",
                        help="robots, groups, kinds or case numbers; given several times, all must hold")  # fmt: skip
    parser.add_argument("--rivals", default=",".join(_ROBOTS), metavar="A,B",
                        help="robots on which other methods run too, where the suite has them")  # fmt: skip
    parser.add_argument("--limit", type=int, default=None, help="cases at most")
    parser.add_argument(
        "--seconds", type=float, default=np.inf, help="begin no case after this long, drop what is unfinished"
    )
    parser.add_argument("--policy", type=Path, help="folder of an exported policy, for the G1 that tracks motions")
    parser.add_argument("--list", action="store_true", help="print the cases and end")
    parser.add_argument("--table", type=Path, nargs="+", metavar="FILE", help="print the table of results and end")
    return parser.parse_args(argv)


if __name__ == "__main__":
    raise SystemExit(main())
