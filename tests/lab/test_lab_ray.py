"""Stages on several machines: a Ray head and two workers with work trees of their own give one machine's files.

The stages are the smoke profile's first ones, up to the experts of both clusters side by side: motions (which stays on
the head), filter, cluster, base, experts@c0, experts@c1.
"""

import contextlib
import csv
import hashlib
import io
import json
import os
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import psutil
import pytest
import yaml

from flows import workspace as workspaces
from flows.environment import environment
from tests.lab import cluster as clusters
from tests.lab import machines
from tests.lab.conftest import LabOnThisMachine

STAGES = ("motions", "filter", "cluster", "base", "experts")
LIMIT = 900  # [s]
TIMES = ("seconds",)  # columns of a curve


@dataclass(frozen=True)
class Stand:
    """A cluster that runs, and what a workspace needs to use it."""

    cluster: clusters.Cluster
    content: dict[str, Any]
    """Of lab.yaml."""


@pytest.fixture(scope="module")
def stand(lab: LabOnThisMachine) -> Iterator[Stand]:
    """One cluster for the tests of this module; the last one kills a worker of it."""
    if find_spec("ray") is None:
        (pytest.fail if "BUMBLEBEE_LAB_TEST" in os.environ else pytest.skip)("no package ray")
    patch = pytest.MonkeyPatch()
    with tempfile.TemporaryDirectory(dir="/tmp", ignore_cleanup_errors=True) as scratch:
        folder = Path(scratch)
        (folder / "dvc").mkdir()
        clusters.new_token(folder / "token")
        patch.setenv("RAY_AUTH_MODE", "token")
        patch.setenv("RAY_AUTH_TOKEN_PATH", str(folder / "token"))
        try:
            with clusters.cluster(folder, 2) as made:
                ray = {"address": made.address, "remote": str(folder / "dvc")}
                yield Stand(made, {**lab.content(), "ray": ray})
        finally:
            patch.undo()


def workspace(folder: Path, content: dict[str, Any] | None, **over: Any) -> Path:
    """The smoke profile's first stages."""
    made = workspaces.create(folder / "demo", "smoke", **over)
    pipeline = yaml.safe_load((made / "dvc.yaml").read_text())
    pipeline["stages"] = {name: pipeline["stages"][name] for name in STAGES}
    (made / "dvc.yaml").write_text(yaml.safe_dump(pipeline, sort_keys=False))
    if content is not None:
        (made / "lab.yaml").write_text(yaml.safe_dump(content))
    return made


def call(folder: Path, *words: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """A program of ours in the workspace, to its end."""
    settings = {**environment(folder), **variables}
    command = [sys.executable, *words]
    return subprocess.run(command, cwd=folder, env=settings, capture_output=True, text=True, check=False, timeout=LIMIT)


def locked(folder: Path) -> dict[str, Any]:
    return yaml.safe_load((folder / "dvc.lock").read_text())["stages"]


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
    ended = call(made, "-c", f"{change}\nimport sys\nfrom flows.ray_cluster import main\nsys.exit(main([]))")
    assert ended.returncode == 2 and line in ended.stderr and len(ended.stderr.splitlines()) == 1, ended.stderr


def test_one_worker_is_killed_and_the_files_are_those_of_one_machine(
    lab: LabOnThisMachine, stand: Stand, tmp_path: Path
) -> None:
    (tmp_path / "one").mkdir()
    one = workspace(tmp_path / "one", None)
    alone = call(one, "-m", "dvc", "repro", "-q")
    assert alone.returncode == 0, alone.stdout + alone.stderr
    made = workspace(tmp_path, stand.content)
    command = [sys.executable, "-m", "flows.demo", "--workspace", "."]
    with (tmp_path / "said").open("w+") as said:
        run = subprocess.Popen(command, cwd=made, env=environment(made), stdout=said, stderr=said)
        try:
            killed = kill_a_worker_at_experts(stand.cluster, run)
            status = run.wait(LIMIT)
        finally:
            if run.poll() is None:
                run.send_signal(signal.SIGTERM)
                run.wait(60)
        text = (tmp_path / "said").read_text()
    assert status == 0, text[-3000:]
    assert text.count(f"{killed}: its machine was lost; the stage starts again on another one") == 1, text
    assert text.count("its machine was lost") == 1, text
    assert untrained(locked(made)) == untrained(locked(one))
    ours, theirs = files(made), files(one)
    assert {name: timeless(name, ours[name]) for name in ours} == {
        name: timeless(name, theirs[name]) for name in theirs
    }
    assert sum(name.endswith("policy.onnx") for name in ours) == 3
    assert set(locked(made)) == {"motions", "filter", "cluster", "base", "experts@c0", "experts@c1"}
    assert logged_on_one(one) == logged_in_lab(lab) != []
    assert files(colleague(tmp_path / "other", made)) == ours
    for worker in stand.cluster.workers:
        assert any((worker.folder / "cache" / "files").rglob("*")), "a worker that had nothing to do"
        if worker.process.returncode is None:
            assert not list((worker.folder / "trees").iterdir())


def logged_on_one(folder: Path) -> list[str]:
    """Names of the runs that MLflow has of a workspace without a lab."""
    with contextlib.closing(sqlite3.connect(folder / ".servers" / "mlflow.db")) as history:
        return sorted(name for (name,) in history.execute("SELECT name FROM runs"))


def logged_in_lab(lab: LabOnThisMachine) -> list[str]:
    """The same of the lab's database, whichever machine logged them."""
    query = "SELECT runs.name FROM runs JOIN experiments USING (experiment_id) WHERE experiments.name = 'demo'"
    return sorted(lab.postgres.sql(query, "mlflow").split("\n")[:-1])


def colleague(folder: Path, made: Path) -> Path:
    """Another folder with the pipeline and its lock, and `dvc pull` there."""
    for name in ("dvc.yaml", "dvc.lock", "params.yaml", "lab.yaml", ".dvc/config", ".dvc/config.local"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(made / name, folder / name)
    pulled = call(folder, "-m", "dvc", "pull", "-q")
    assert pulled.returncode == 0, pulled.stderr
    return folder


def files(folder: Path) -> dict[str, bytes]:
    """What stages made."""
    outs = [out["path"] for stage in locked(folder).values() for out in stage["outs"]]
    found = [file for out in outs for file in (folder / out).rglob("*") if file.is_file()]
    return {str(file.relative_to(folder)): file.read_bytes() for file in found}


def timeless(name: str, content: bytes) -> object:
    """A file without how long the training took, which a policy's card and curve say and no two runs agree on."""
    if name.endswith("/card.json"):
        card = json.loads(content)
        assert card.pop("seconds") > 0 and card.pop("frames_per_second") > 0
        return card
    if name.endswith("/curve.csv"):
        return [
            {key: row[key] for key in row if key not in TIMES} for row in csv.DictReader(io.StringIO(content.decode()))
        ]
    return hashlib.md5(content).hexdigest()


def untrained(lock: dict[str, Any]) -> dict[str, Any]:
    """dvc.lock without the hashes of folders that hold a card: those of policies."""
    return {
        name: {
            **stage,
            **{key: [entry for entry in stage[key] if not policy(entry["path"])] for key in ("deps", "outs")},
        }
        for name, stage in lock.items()
    }


def policy(path: str) -> bool:
    return path.startswith(("models/base", "models/experts"))


def kill_a_worker_at_experts(made: clusters.Cluster, run: "subprocess.Popen[bytes]") -> str:
    """Wait until both workers train an expert, end the first of them with all its processes; that expert's stage."""
    end = time.monotonic() + LIMIT
    while time.monotonic() < end and run.poll() is None:
        at = {worker: next(worker.folder.glob("trees/*/demo/.scratch/experts-*"), None) for worker in made.workers}
        if all(at.values()):
            worker, place = next(iter(at.items()))
            assert place is not None and psutil.pid_exists(worker.process.pid)
            worker.kill()
            (name,) = re.findall(r"-(c\d+)-", place.name)
            return f"experts@{name}"
        time.sleep(0.05)
    raise AssertionError(f"both workers at an expert: never; the run's status is {run.poll()}")
