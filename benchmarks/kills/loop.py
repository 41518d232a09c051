"""Cells of the loop: a copy of a finished workspace in which one stage is stale; hit, look, start again."""

import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

import yaml

from benchmarks.kills.cell import SIGNALS, Cell, Outcome
from benchmarks.kills.processes import GRACE, PATIENCE, last_line, orphans, start, wait_end, wait_for
from bumblebee.errors import BadInput
from flows.environment import environment
from flows.stages import changed_stages, read_stages
from flows.workspace import CODE, HOME

# How a target is known by its command line; {stage} is the stage's module, {name} DVC's name of the instance.
WORDS = {
    "keeper": ("flows.demo",),
    "flow": ("flows.walk",),
    "dvc": ("flows.reproduce", "{name}"),
    "stage": ("tasks.{stage}",),
    "recorder": ("tasks.running.recorder",),
    "prefect": ("flows.servers.front", "prefect"),
    "mlflow": ("flows.servers.front", "mlflow"),
}
ENDED = ("keeper", "flow", "dvc", "stage")  # with which the run ends
SERVERS = ("prefect", "mlflow")  # without which it goes on: hit during its last stage
DELAY = 0.3  # [s] that a stage works before the blow


def cells() -> list[Cell]:
    """Every process with every signal, every stage with -9, full disks, and two at once."""
    base = [Cell(target, "base", how) for target in ENDED for how in SIGNALS]
    base += [Cell(target, "report", how) for target in SERVERS for how in SIGNALS]
    names = ["seal", "motions", "filter", "cluster", "experts@cluster0", "rollouts@after0-cluster0", "ingest@after0"]
    names += ["diagnose@after0", "delta@after0-cluster1", "refine@after0-cluster0", "distill", "evaluate"]
    stages = [Cell("stage", name, "-9") for name in [*names, "publish", "report"]]
    loops = [Cell("keeper", name, "-9") for name in ("rollouts@after0-cluster0", "publish")]
    full = [Cell("stage", name, "disk full") for name in ("motions", "base", "rollouts@after0-cluster0", "publish")]
    return [*base, *stages, *loops, Cell("recorder", "publish", "-9"), *full, Cell("keeper", "filter", "two at once")]


def run(cell: Cell, finished: Path, scratch: Path) -> Outcome:
    """One cell in a fresh copy of the finished workspace."""
    folder = scratch / "workspace"
    with disk(folder, cell.how == "disk full") as fill:
        copy(finished, folder)
        names = {stage.name for stage in read_stages(folder)}
        name = instance(cell.stage, names)
        make_stale(folder, name)
        before = changed_stages(folder)
        log = scratch / "log.txt"
        log.write_bytes(b"")
        status, seconds, said, left_alive = blow(cell, name, folder, log, fill)
        lost = sorted(changed_now(folder) - before - after(folder, name))
        half = half_written(folder)
        fill(False)
        again = goes_on(cell, name, folder, log)
        traceback = "Traceback (most recent call last)" in log.read_text(errors="replace")
        left_alive += orphans(cell.name)
    return Outcome(cell.name, round(seconds, 1), status, said, tuple(lost), tuple(left_alive), half, traceback, again)


def blow(cell: Cell, name: str, folder: Path, log: Path, fill: "Fill") -> tuple[int | None, float, str, list[str]]:
    """Start the loop, wait until the stage works, hit; (status, seconds until the end, last line, orphans)."""
    words = ["-m", "flows.demo", "--verbose", "--workspace", str(folder)]
    running = start(words, folder, environment(folder), cell.name, log)
    facts = {"stage": name.partition("@")[0], "name": name}
    stage = [word.format(**facts) for word in WORDS["stage"]]
    second: subprocess.Popen[bytes] | None = None
    if cell.how == "two at once":
        second = start(words, folder, environment(folder), cell.name, log)
    elif cell.how == "disk full":
        wait_for(stage, running)
        fill(True)
    else:
        wait_for(stage, running)
        target = wait_for([word.format(**facts) for word in WORDS[cell.target]], running)
        time.sleep(DELAY)
        target.send_signal(SIGNALS[cell.how])
    status, seconds = wait_end(running)
    if second is not None:
        other, more = wait_end(second)
        status, seconds = (status if other == 0 else other), seconds + more
    return status, seconds, last_line(log), orphans(cell.name)


def goes_on(cell: Cell, name: str, folder: Path, log: Path) -> int | None:
    """Run the command once more, until the stage is done; what comes after it is not waited for.

    Returns 0 when it is, else the command's exit status, None where it does neither.
    """
    words = ["-m", "flows.demo", "--verbose", "--workspace", str(folder)]
    running = start(words, folder, environment(folder), cell.name, log)
    end = time.monotonic() + PATIENCE
    while running.poll() is None and time.monotonic() < end and not done(folder, name):
        time.sleep(0.5)
    if running.poll() is None:
        running.send_signal(signal.SIGTERM)
    status, _ = wait_end(running)
    return 0 if done(folder, name) else status


def changed_now(folder: Path) -> set[str]:
    """The stages that differ from dvc.lock, once its lock is free: a killed holder counts until the system reaps it."""
    end = time.monotonic() + GRACE
    while True:
        try:
            return changed_stages(folder)
        except BadInput:
            if time.monotonic() > end:
                raise
            time.sleep(0.5)


def done(folder: Path, name: str) -> bool:
    """Whether DVC has noted the stage as finished."""
    return name in ((yaml.safe_load((folder / "dvc.lock").read_text()) or {}).get("stages") or {})


def copy(finished: Path, folder: Path) -> None:
    """The workspace as it was when it finished, with the code of this checkout and no memory of earlier runs of DVC."""
    shutil.copytree(
        finished, folder, symlinks=True, dirs_exist_ok=True, ignore=shutil.ignore_patterns(".servers", "tmp")
    )
    for code in CODE:
        (folder / code).unlink(missing_ok=True)
        (folder / code).symlink_to(HOME / code)
    (folder / ".dvc" / "tmp").mkdir(parents=True, exist_ok=True)
    shutil.copytree(
        finished / ".servers", folder / ".servers", ignore=shutil.ignore_patterns("prefect*", "addresses*", "*.lock")
    )
    shutil.rmtree(folder / ".dvc" / "cache" / "runs", ignore_errors=True)


def instance(wanted: str, names: set[str]) -> str:
    """DVC's name of a stage; `@cluster0` and the like stand for the first and second of its instances."""
    if wanted in names:
        return wanted
    kind, _, which = wanted.partition("@")
    alike = sorted(name for name in names if name.partition("@")[0] == kind)
    return alike[1 if which.endswith("1") else 0]


def make_stale(folder: Path, name: str) -> None:
    """Forget one stage: its entry in dvc.lock and its output."""
    lock = folder / "dvc.lock"
    content = yaml.safe_load(lock.read_text())
    entry = content["stages"].pop(name)
    lock.write_text(yaml.safe_dump(content, sort_keys=False))
    for out in entry.get("outs", []):
        path = folder / out["path"]
        shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)


def after(folder: Path, name: str) -> set[str]:
    """The stage and everything that reads, directly or not, what it makes."""
    from flows.stages import downstream

    return downstream(read_stages(folder), name) | {name}


def half_written(folder: Path) -> tuple[str, ...]:
    """Unfinished output under the names that somebody reads; what begins with a dot is nobody's, and goes next time."""
    seen = []
    for root in ("data", "models", "reports"):
        for path in (folder / root).rglob("*"):
            hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
            if path.is_file() and not hidden and path.stat().st_size == 0:
                seen.append(str(path.relative_to(folder)))
    return tuple(seen)


class Fill:
    """Fill the disk that a workspace lies on, and empty it again; nothing where it has none of its own."""

    def __init__(self, folder: Path | None) -> None:
        self.path = None if folder is None else folder / ".filler"

    def __call__(self, full: bool) -> None:
        """Leave no byte, or give all back."""
        if self.path is None:
            return
        self.path.unlink(missing_ok=True)
        if not full:
            return
        handle, size = os.open(self.path, os.O_WRONLY | os.O_CREAT), 1 << 20
        while size:
            try:
                os.write(handle, bytes(size))
            except OSError:
                size //= 2
        os.close(handle)


class disk:  # noqa: N801 (a context manager, used as a function)
    """The workspace on a disk of its own of 200 MB where it is to be filled (as root, on Linux), else as it is."""

    def __init__(self, folder: Path, own: bool) -> None:
        self.folder, self.own = folder, own

    def __enter__(self) -> Fill:
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir(parents=True)
        if self.own:
            subprocess.run(["mount", "-t", "tmpfs", "-o", "size=200m", "tmpfs", str(self.folder)], check=True)
        return Fill(self.folder if self.own else None)

    def __exit__(self, *_: object) -> None:
        if self.own:
            subprocess.run(["umount", "-l", str(self.folder)], check=True)
        shutil.rmtree(self.folder, ignore_errors=True)
