"""Parcel of a stage for another machine, and what it asks of that machine; no cluster."""

import io
import os
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest
import yaml

from bumblebee.errors import BadInput
from bumblebee.last_line import disk_line
from flows import gpus
from flows.cluster import away, node, parcel, ray_cluster
from flows.stages import Stage
from tasks.lab.servers import Lab, MlflowLab, PrefectLab, RayLab

CODE = "from pathlib import Path\nprint('worked', Path('data/in.txt').read_text())\nraise SystemExit(3)\n"


def lab(remote: str) -> Lab:
    store = MlflowLab("postgresql://u@db/mlflow", "s3://bucket/mlflow", "https://s3.lab:8333")
    return Lab(PrefectLab("postgresql://u@db/prefect"), store, RayLab("head:6379", remote))


class Nodes:
    """As much of Ray as says what its machines have."""

    def __init__(self, *machines: dict[str, float]) -> None:
        self.machines = machines

    def nodes(self) -> list[dict[str, object]]:
        return [{"Alive": True, "Resources": {"CPU": 1.0, **machine}} for machine in self.machines]


def test_what_neither_a_stage_makes_nor_is_code_travels():
    deps = [
        "tasks/rollouts.py",
        "bumblebee/sim",
        "data/incoming",
        "models",
        "data/rollouts/r1",
        "data/a/b",
        "/srv/clips",
    ]
    outs = ["models/base", "data/rollouts/r1/c0", "data/a"]
    assert parcel.plain_inputs(deps, outs) == ["data/incoming", "/srv/clips"]


def test_all_that_came_before_is_pulled_but_no_set_of_the_users():
    needs = {"a": set(), "b": {"a"}, "c": {"b", "data/raw/x.dvc"}, "d": {"a"}, "data/raw/x.dvc": set()}
    stages = [Stage(name, "", frozenset(before), frozenset()) for name, before in needs.items()]
    assert away.ancestors(stages, "c") == ("a", "b")
    assert away.ancestors(stages, "a") == ()


def test_gpus_are_those_of_the_sections_or_one_for_the_engine_on_a_gpu():
    content = {
        "clusters": ["c0"],
        "delta": {"engine": "mujoco"},
        "experts": {"gpus": 4},
        "refine": {"env": {"engine": "mujoco_warp"}},
    }
    asked = [gpus.wanted(content, names) for names in ([], ["delta", "clusters"], ["refine"], ["refine", "experts"])]
    assert asked == [0, 0, 1, 4]
    assert gpus.wanted({"delta": {"engine": "mujoco_warp"}}, ["delta"]) == 1


def test_a_stage_asks_for_its_gpus_and_its_memory():
    own = RayLab("head:6379", "/shared/dvc", {"experts": 1.5})
    content = {"experts": {"gpus": 2}}
    asked = ray_cluster.need(own, content, "experts", ["experts"])
    assert asked.options == {"num_cpus": 1, "num_gpus": 2, "memory": 1.5 * 2**30}
    assert ray_cluster.need(own, content, "base", ["base"]).options == {"num_cpus": 1, "num_gpus": 0}


@pytest.mark.parametrize(
    ("wanted", "line"),
    [
        (ray_cluster.Need(4, 0), "expected at most 2 GPUs, which one machine of the Ray cluster has, came 4"),
        (ray_cluster.Need(0, 80), "expected at most 64.0 GiB, which one machine of the Ray cluster gives, came 80"),
        (
            ray_cluster.Need(1, 32),
            "expected at most 16.0 GiB, which one machine of the Ray cluster gives beside 1 GPUs, came 32",
        ),
    ],
)
def test_what_no_single_machine_has_is_one_line(wanted: ray_cluster.Need, line: str):
    cluster = Nodes({"memory": 64.0 * 2**30}, {"GPU": 2.0, "memory": 16.0 * 2**30})
    with pytest.raises(BadInput) as caught:
        ray_cluster.require_room(cluster, wanted, "lab.yaml")
    assert line in str(caught.value)
    ray_cluster.require_room(cluster, ray_cluster.Need(2, 16), "lab.yaml")
    ray_cluster.require_room(cluster, ray_cluster.Need(0, 64), "lab.yaml")


def test_the_address_may_come_from_an_allocation(monkeypatch: pytest.MonkeyPatch):
    own = RayLab("auto", "/shared/dvc")
    monkeypatch.setenv("RAY_ADDRESS", "node7:6379")
    assert ray_cluster.address_of(own, "ray") == "node7:6379"
    monkeypatch.setenv("RAY_ADDRESS", "local")
    with pytest.raises(BadInput, match="expected HOST:PORT in the variable RAY_ADDRESS, came local"):
        ray_cluster.address_of(own, "ray")


def test_the_remote_of_a_work_tree_has_the_labs_store_only_where_it_is_s3():
    assert "endpointurl = https://s3.lab:8333" in parcel.dvc_settings(lab("s3://bucket/dvc"))
    settings = parcel.dvc_settings(lab("/shared/dvc"))
    assert "url = /shared/dvc" in settings and "endpointurl" not in settings


def test_another_remote_of_the_workspace_is_not_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / ".dvc").mkdir()
    away.settle(lab("/shared/dvc"))
    away.settle(lab("/shared/dvc"))
    with pytest.raises(BadInput, match="expected url = /other/dvc, came another remote"):
        away.settle(lab("/other/dvc"))


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """A workspace whose code is linked, as real ones are."""
    home, folder = tmp_path / "home", tmp_path / "work"
    (home / "tasks" / "__pycache__").mkdir(parents=True)
    (home / "tasks" / "__pycache__" / "own.pyc").write_bytes(b"")
    (home / "tasks" / "__init__.py").touch()
    (home / "tasks" / "own.py").write_text(CODE)
    (folder / "data").mkdir(parents=True)
    (folder / "tasks").symlink_to(home / "tasks")
    (folder / "data" / "in.txt").write_text("hard")
    (folder / "params.yaml").write_text(yaml.safe_dump({"clusters": []}))
    return folder


def test_a_parcel_has_code_settings_and_inputs_and_no_caches(workspace: Path):
    packed = parcel.pack(workspace, ["data/in.txt", "data/not-there"], "[core]\n")
    with tarfile.open(fileobj=io.BytesIO(packed)) as found:
        names = [entry.name for entry in found if entry.isfile()]
    assert sorted(names) == [".dvc/config", "data/in.txt", "params.yaml", "tasks/__init__.py", "tasks/own.py"]
    assert parcel.size(workspace, ["data"]) == 4


def test_a_machine_runs_it_in_a_tree_of_its_own_says_what_it_said_and_leaves_nothing(
    workspace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv(node.PLACE, str(tmp_path / "node"))
    left = tmp_path / "node" / "trees" / "killed"
    left.mkdir(parents=True)
    (left / "lock").touch()
    packed = parcel.pack(workspace, ["data/in.txt"], "[core]\n")
    said = list(node.run(packed, "work", ["tasks.own"], {}))
    assert said[1:] == ["worked hard", 3]
    assert list((tmp_path / "node" / "trees").iterdir()) == []


def test_a_tree_in_use_is_left_alone(workspace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv(node.PLACE, str(tmp_path / "node"))
    packed = parcel.pack(workspace, ["data/in.txt"], "[core]\n")
    first = node.run(packed, "work", ["tasks.own"], {})
    next(first)
    assert list(node.run(packed, "work", ["tasks.own"], {}))[-1] == 3
    assert list(first)[-1] == 3


def test_what_a_machine_lacks_is_said(tmp_path: Path):
    found = node.facts(("dvc", "no-such-package"), str(tmp_path / "nowhere"), "")
    assert found["no-such-package"] == "" and found["dvc"] and "nowhere that may be written" in found["fault"]
    assert node.facts((), str(tmp_path), "")["fault"] == ""
    assert node.facts((), "", "no_such_module")["fault"] == "no package no-such-module"


def test_a_full_disk_of_another_machine_is_the_disks_line() -> None:
    exceptions = pytest.importorskip("ray.exceptions")
    told = exceptions.RayTaskError("run", "a traceback", OSError(28, "No space left on device", "/node/trees/x"))
    found = away.of_the_machine(told.as_instanceof_cause())
    assert isinstance(found, OSError) and "/node/trees/x: expected a disk" in (disk_line(found) or "")
    other = exceptions.RayTaskError("run", "a traceback", ValueError("x")).as_instanceof_cause()
    assert away.of_the_machine(other) is other


def test_without_a_cluster_nothing_of_ray_is_imported():
    code = "import sys, flows.loop, flows.demo, flows.walk\nassert not {'ray', 'flows.cluster.away'} & set(sys.modules)"
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, env={**os.environ}
    )
    assert ended.returncode == 0, ended.stderr
