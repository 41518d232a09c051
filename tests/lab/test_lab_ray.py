"""Stages on several machines: a Ray head and two workers with work trees of their own give one machine's files.

The loop is the smoke profile's, all of it, both clusters side by side.
"""

import contextlib
import re
import signal
import sqlite3
import subprocess
import sys
import tarfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import psutil
import pytest
import yaml

from flows.cluster.checkpoints import FOLDER
from flows.environment import environment
from tests.lab import cluster as clusters
from tests.lab import machines
from tests.lab.conftest import LabOnThisMachine, Stand
from tests.lab.loops import LIMIT, call, colleague, files, locked, timeless, untimed, workspace

LONG = {"experts": {"ppo": {"iterations": 10, "checkpoint_every": 2}}}  # to be killed in the middle
# What it finds depends on no clock; and few windows, since this is not about what it finds.
WINDOWS = {"max_windows": 8, "max_holdout_windows": 8, "report_windows": 8}
STEADY = {"diagnose": {"beyond_seconds": 1e-9, "search_seconds": 3600, **WINDOWS}}


def refused(folder: Path, content: dict[str, Any], **variables: str) -> str:
    """The one line with which the loop ends, before any server or stage starts."""
    (folder / "lab.yaml").write_text(yaml.safe_dump(content))
    ended = call(folder, "-m", "flows.demo", "--workspace", ".", **variables)
    lines = [line for line in ended.stderr.splitlines() if line.strip()]
    assert (ended.returncode, len(lines)) == (2, 1), ended.stderr
    assert not (folder / ".servers" / "addresses.json").exists() and not (folder / "data" / "motions").exists()
    return lines[0]


def test_a_cluster_that_is_not_there_or_does_not_fit_is_one_line(stand: Stand, tmp_path: Path) -> None:
    made = workspace(tmp_path, None)
    nobody = f"{machines.HOST}:{clusters.port()}"
    line = refused(made, {**stand.content, "ray": {**stand.content["ray"], "address": nobody}})
    assert f"ray.address: expected a Ray cluster at {nobody}" in line
    line = refused(made, {**stand.content, "ray": {**stand.content["ray"], "remote": "/nowhere/dvc"}})
    assert "ray.remote: expected DVC's remote to be usable" in line and "/nowhere/dvc" in line
    clusters.new_token(tmp_path / "token")
    line = refused(made, stand.content, RAY_AUTH_TOKEN_PATH=str(tmp_path / "token"))
    assert f"ray.address: expected to join {stand.cluster.address}" in line and "~/.ray/auth_token" in line


def test_a_gpu_that_no_machine_has_is_one_line(stand: Stand, tmp_path: Path) -> None:
    made = workspace(tmp_path, None, experts={"env": {"engine": "mujoco_warp"}, "gpus": 2})
    line = refused(made, stand.content)
    assert "experts.gpus: expected at most 0 GPUs, which one machine of the Ray cluster has, came 2" in line


def test_memory_that_no_machine_has_is_one_line(stand: Stand, tmp_path: Path) -> None:
    made = workspace(tmp_path, None)
    line = refused(made, {**stand.content, "ray": {**stand.content["ray"], "memory": {"base": 500}}})
    assert "ray.memory.base: expected at most 2.0 GiB, which one machine of the Ray cluster gives, came 500" in line
    line = refused(made, {**stand.content, "ray": {**stand.content["ray"], "memory": {"expert": 1}}})
    assert "ray.memory: expected stages of dvc.yaml: motions, filter" in line and "came expert" in line


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ("import ray; ray.__version__ = '2.1.0'", "expected the versions of Ray and Python that this process has"),
        ("import platform; platform.python_version = lambda: '3.11.0'", "expected Python 3.11.0 on every machine"),
        (
            "from importlib import metadata as m; real = m.version; "
            "m.version = lambda name: '3.9.0' if name == 'mujoco' else real(name)",
            "expected mujoco 3.9.0 on every machine, came 4.0.0 on",
        ),
    ],
)
def test_other_versions_on_the_cluster_are_one_line(stand: Stand, tmp_path: Path, change: str, line: str) -> None:
    made = workspace(tmp_path, stand.content)
    ended = call(made, "-c", f"{change}\nimport sys\nfrom flows.cluster.ray_cluster import main\nsys.exit(main([]))")
    assert ended.returncode == 2 and line in ended.stderr and len(ended.stderr.splitlines()) == 1, ended.stderr


def test_one_worker_is_killed_and_the_whole_loop_ends_as_on_one_machine(
    lab: LabOnThisMachine, stand: Stand, tmp_path: Path
) -> None:
    (tmp_path / "one").mkdir()
    one = workspace(tmp_path / "one", None, **LONG, **STEADY)
    content = {**stand.content, "ray": {**stand.content["ray"], "memory": {"experts": 1.5, "refine": 1.5}}}
    made = workspace(tmp_path, content, **LONG, **STEADY)
    with ThreadPoolExecutor(1) as pool:  # both at once: half of the time is waiting
        alone = pool.submit(call, one, "-m", "dvc", "repro", "-q")
        cluster, status, text = run_and_kill(stand, made, tmp_path / "said")
    assert alone.result().returncode == 0, alone.result().stdout + alone.result().stderr
    assert status == 0, text[-3000:]
    lost = f"experts@{cluster}: its machine was lost; another one goes on from its last checkpoint"
    assert text.count(lost) == text.count("its machine was lost") == 1, text
    assert re.findall(r"expert-(c\d)-r0: goes on after iteration [2468] of 10", text) == [cluster], text
    assert untimed(locked(made)) == untimed(locked(one))
    ours, theirs = files(made), files(one)
    assert timeless(ours) == timeless(theirs)
    assert sum(name.endswith("policy.onnx") for name in ours) == 10
    assert not list((Path(stand.content["ray"]["remote"]) / FOLDER).iterdir())
    assert logged_on_one(one) == logged_in_lab(lab) != []
    assert files(colleague(tmp_path / "other", made)) == ours
    for worker in stand.cluster.workers:
        assert any((worker.folder / "cache" / "files").rglob("*")), "a worker that had nothing to do"
        if worker.process.returncode is None:
            assert not list((worker.folder / "trees").iterdir())


def run_and_kill(stand: Stand, made: Path, said: Path) -> tuple[str, int, str]:
    """The loop with one worker killed under it: the lost expert's cluster, the loop's status, and what it said."""
    command = [sys.executable, "-m", "flows.demo", "--workspace", "."]
    with said.open("w") as out:
        run = subprocess.Popen(command, cwd=made, env=environment(made), stdout=out, stderr=out)
        try:
            lost = kill_a_worker_with_a_checkpoint(stand, run)
            status = run.wait(LIMIT)
        finally:
            if run.poll() is None:
                run.send_signal(signal.SIGTERM)
                run.wait(60)
    return lost, status, said.read_text()


def logged_on_one(folder: Path) -> list[str]:
    """Names of the runs that MLflow has of a workspace without a lab."""
    with contextlib.closing(sqlite3.connect(folder / ".servers" / "mlflow.db")) as history:
        return sorted(name for (name,) in history.execute("SELECT name FROM runs WHERE lifecycle_stage = 'active'"))


def logged_in_lab(lab: LabOnThisMachine) -> list[str]:
    """Stages logged in the lab's database, whichever machine logged them."""
    query = "SELECT runs.name FROM runs JOIN experiments USING (experiment_id)"
    query += " WHERE experiments.name = 'demo' AND runs.lifecycle_stage = 'active'"
    return sorted(lab.postgres.sql(query, "mlflow").split("\n")[:-1])


def kill_a_worker_with_a_checkpoint(stand: Stand, run: "subprocess.Popen[bytes]") -> str:
    """Wait until both workers train an expert and one has a checkpoint in the store; end that one. Its cluster."""
    end = time.monotonic() + LIMIT
    while time.monotonic() < end and run.poll() is None:
        at = {
            worker: next(worker.folder.glob("trees/*/demo/.scratch/experts-*"), None)
            for worker in stand.cluster.workers
        }
        if all(at.values()):
            stored = experts_stored(Path(stand.content["ray"]["remote"]) / FOLDER)
            for worker, place in at.items():
                if place is not None and place.name in stored:
                    assert psutil.pid_exists(worker.process.pid)
                    worker.kill()
                    (name,) = re.findall(r"-(c\d+)-", place.name)
                    return name
        time.sleep(0.05)
    raise AssertionError(f"a checkpoint while both workers train an expert: never; the run's status is {run.poll()}")


def experts_stored(shelves: Path) -> set[str]:
    """Names of the folders with checkpoints that the store has, of those that are whole."""
    found = set()
    for file in shelves.glob("*/*.tar"):
        with contextlib.suppress(OSError, tarfile.TarError), tarfile.open(file) as packed:
            found |= {name.partition("/")[0] for name in packed.getnames() if name.endswith("checkpoint.pt")}
    return found
