"""The soak itself: references first, then loops one after the other with the faults beside them."""

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from benchmarks.lab_soak import facts, faults, loops
from benchmarks.lab_soak.record import Record, read
from benchmarks.lab_soak.stand import WORKERS, Stand, clear, stand
from tasks.lab.servers import read_lab
from tasks.running.lineage import git_sha

LATE = 600.0  # [s] after the last fault that the loop at work has to end


@dataclass(frozen=True)
class Plan:
    """Plan of a soak."""

    minutes: float
    """Length, without the references and the end of the last loop."""
    seed: int
    """Seed of the faults' schedule."""
    seeds: int
    """Different loops, each with a reference."""
    workers_every: float
    """Seconds between two workers that are killed."""
    others_every: float
    """Seconds between two other faults."""


def soak(plan: Plan, record: Record, earlier: Path | None) -> None:
    """Everything, until the time is over.

    Args:
        plan: what.
        record: whose folder also takes what the loops say.
        earlier: the record of a soak of the same code, whose references are taken over.
    """
    record.write("begin", minutes=plan.minutes, seed=plan.seed, git_sha=git_sha())
    known = {} if earlier is None else loops.references(read(earlier))
    with tempfile.TemporaryDirectory(dir="/tmp", prefix="s", ignore_cleanup_errors=True) as scratch:
        Path(scratch).chmod(0o755)  # PostgreSQL is another user
        for seed in range(plan.seeds):
            if seed in known:
                record.write("reference", **known[seed])
            else:
                loops.reference(Path(scratch) / f"reference{seed}", seed, record)
        with stand(Path(scratch) / "lab") as made:
            record.write("stands")
            under_faults(plan, record, made)
    record.write("over")


def under_faults(plan: Plan, record: Record, made: Stand) -> None:
    """Loops, and the faults beside them."""
    seconds, now = 60.0 * plan.minutes, loops.Running()
    planned = faults.schedule(plan.seed, seconds, plan.workers_every, plan.others_every, WORKERS)
    injector = faults.Injector(planned, made, now, record)
    began, number = time.time(), 0
    injector.start()
    while time.time() < began + seconds:
        number += 1
        job = loops.Job(number, number % plan.seeds, made.loops / f"soak-{number:03d}", began + seconds + LATE)
        one(job, record, made, now)
        for folder in (job.folder, remote(made, job), *(made.folder / f"worker{n}" / "cache" for n in range(WORKERS))):
            clear(folder)
    injector.over.set()
    injector.join()


def remote(made: Stand, job: loops.Job) -> Path:
    """DVC's shared remote of a loop, one of its own."""
    return made.folder / "dvc" / f"{job.number:03d}"


def one(job: loops.Job, record: Record, made: Stand, now: loops.Running) -> None:
    """One loop, and what it has left."""
    remote(made, job).mkdir()
    content = made.content(remote(made, job))
    salt = f"loop {job.number}"
    created = patiently(lambda: loops.create(job.folder, job.seed, salt, content), job, record, "create failed")
    if created and loops.loop(job, record, now):
        patiently(lambda: left(job, record), job, record, "not read yet")


def left(job: loops.Job, record: Record) -> None:
    """Write down what the loop has left."""
    lab = read_lab(job.folder)
    assert lab is not None
    record.write("loop", loop=job.number, seed=job.seed, **facts.of(job.folder, lab.mlflow.connection))


def patiently(act: Callable[[], object], job: loops.Job, record: Record, what: str) -> bool:
    """Do it as soon as what it needs is there again: a disk is full now, or a server away."""
    while time.time() < job.until:
        try:
            act()
            return True
        except Exception as error:
            record.write(what, loop=job.number, error=f"{type(error).__name__}: {error}"[:500])
            time.sleep(loops.PAUSE)
    return False
