"""One loop of the soak: a fresh workspace, `flows.demo` started again until it is done, every stage that ends noted."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from benchmarks.lab_soak import facts, said
from benchmarks.lab_soak.record import Event, Record
from flows import workspace as workspaces
from flows.environment import environment
from flows.processes import end_tree

SALT = "salt.txt"
LOOK, PAUSE = 0.5, 5.0  # [s] between looks; before the same command is started again
HANGS = 600.0  # [s] without a new line and a new stage: it is ended, which the judge counts as a fault of ours
TRIES = 40
LEFT_OUT = ("report",)  # reads what all loops before have left in the registry, and makes a page of it
SEEDED = ("seal", "cluster", "base", "experts", "distill")
TRAINING = {"env": {"num_worlds": 8}, "ppo": {"iterations": 2, "steps": 8, "hidden": [32, 32], "checkpoint_every": 1}}
TINY: dict[str, Any] = {
    "seal": {"n_effects": 0},
    "cluster": {"epochs": 1, "audit_seeds": 1, "max_k": 2},
    "base": TRAINING,
    "experts": TRAINING,
    "distill": {"iterations": 1, "env": {"num_worlds": 8}},
    "evaluate": {"max_motions": 2, "max_seconds": 0.5, "engines": ["stand_in"]},
}
"""Changes of params.yaml over the smoke profile: the lab is soaked, and a stage should be little but its start."""


@dataclass
class Running:
    """Loop that is at work, which the faults may hit."""

    process: subprocess.Popen[bytes] | None = None


@dataclass(frozen=True)
class Job:
    """One loop."""

    number: int
    seed: int
    folder: Path
    """Its workspace."""
    until: float
    """Time (of `time.time`) after which it is given up."""


def create(folder: Path, seed: int, salt: str, lab: dict[str, Any] | None) -> Path:
    """A workspace: the smoke profile without rounds and tinier, its seeds, and a file that every stage depends on.

    Without the file the stages of an earlier loop of the same seed would be found in DVC's cache of runs.
    """
    seeds = {name: {**TINY[name], "seed": seed} for name in SEEDED}
    made = workspaces.create(folder, "smoke", rounds=[], final_round=0)
    settings = workspaces.merge(yaml.safe_load((made / "params.yaml").read_text()), {**TINY, **seeds})
    (made / "params.yaml").write_text(yaml.safe_dump(settings, sort_keys=False))
    (made / SALT).write_text(f"{salt}\n")
    pipeline = yaml.safe_load((made / "dvc.yaml").read_text())
    stages = {name: stage for name, stage in pipeline["stages"].items() if name not in LEFT_OUT}
    for stage in stages.values():
        stage["deps"].append(SALT)
    (made / "dvc.yaml").write_text(yaml.safe_dump({"stages": stages}, sort_keys=False))
    if lab is not None:
        (made / "lab.yaml").write_text(yaml.safe_dump(lab))
    return made


def reference(folder: Path, seed: int, record: Record) -> None:
    """Run the seed on this machine alone, without servers and faults."""
    made = create(folder, seed, "reference", None)
    command = [sys.executable, "-m", "dvc", "repro", "-q"]
    began = time.monotonic()
    done = subprocess.run(command, cwd=made, env=environment(made), capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"the reference of seed {seed} failed: {done.stderr[-2000:]}")
    seconds = round(time.monotonic() - began, 1)
    address = f"sqlite:///{made / '.servers' / 'mlflow.db'}"
    record.write("reference", seed=seed, seconds=seconds, **facts.of(made, address))


def references(events: list[Event]) -> dict[int, Event]:
    """Seed -> what a record knows of the run without faults."""
    found = (event for event in events if event["what"] == "reference")
    return {event["seed"]: {key: event[key] for key in event if key not in ("what", "at")} for event in found}


def loop(job: Job, record: Record, now: Running) -> bool:
    """Start the command again and again until the loop is done; whether it is.

    Args:
        job: which.
        record: where stages, starts and ends go, and beside it what each start says.
        now: what the faults look at.
    """
    for attempt in range(1, TRIES + 1):
        record.write("start", loop=job.number, attempt=attempt)
        log = record.path.parent / log_name(job.number, attempt)
        status = one(job, record, log, now)
        ends = log.read_text(errors="replace")
        record.write("end", loop=job.number, attempt=attempt, status=status, said=said.telling(ends))
        if status == 0:
            return True
        if time.time() > job.until:
            return False
        time.sleep(PAUSE)
    return False


def log_name(number: int, attempt: int) -> str:
    """Name of the file with what a start says."""
    return f"loop-{number:03d}-{attempt:02d}.log"


def one(job: Job, record: Record, log: Path, now: Running) -> int | str:
    """One start, to its end; its status, `hung` where it had to be ended, `time` where the soak was over."""
    folder, number = job.folder, job.number
    command = [sys.executable, "-m", "flows.demo", "--verbose", "--workspace", str(folder)]
    with log.open("wb") as out:
        process = subprocess.Popen(
            command,
            cwd=folder,
            env=environment(folder),
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=out,
            start_new_session=True,
        )
    now.process, known, moved = process, finished(folder), time.monotonic()
    size = 0
    try:
        while process.poll() is None:
            time.sleep(LOOK)
            new = finished(folder) - known
            for name in sorted(new):
                record.write("stage", loop=number, name=name)
            known |= new
            if new or log.stat().st_size != size:
                moved, size = time.monotonic(), log.stat().st_size
            if time.monotonic() - moved > HANGS:
                return "hung"
            if time.time() > job.until:
                return "time"
        for name in sorted(finished(folder) - known):
            record.write("stage", loop=number, name=name)
        return process.returncode
    finally:
        now.process = None
        end_tree(process.pid)


def finished(folder: Path) -> set[str]:
    """Stages in dvc.lock; none while it is being written."""
    try:
        return set((yaml.safe_load((folder / "dvc.lock").read_text()) or {}).get("stages") or {})
    except (OSError, yaml.YAMLError, AttributeError):
        return set()


def hit(now: Running, find: Callable[[int], Any]) -> bool:
    """SIGKILL to a process of the loop that is at work; whether there was one."""
    process = now.process
    found = None if process is None else find(process.pid)
    if found is None:
        return False
    os.kill(found.pid, signal.SIGKILL)
    return True
