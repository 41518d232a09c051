"""What travels with a stage to another machine, and what it asks of that machine; no cluster."""

import io
import os
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest
import yaml

from bumblebee.errors import BadInput
from flows import away, node, parcel, ray_cluster
from flows.stages import Stage
from tasks.lab import Lab, MlflowLab, PrefectLab, RayLab

CODE = "from pathlib import Path\nprint('worked', Path('data/in.txt').read_text())\nraise SystemExit(3)\n"


def lab(remote: str) -> Lab:
    store = MlflowLab("postgresql://u@db/mlflow", "s3://bucket/mlflow", "https://s3.lab:8333")
    return Lab(PrefectLab("postgresql://u@db/prefect"), store, RayLab("head:6379", remote))


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
    content = {"clusters": ["c0"], "delta": {}, "experts": {"gpus": 4}, "refine": {"env": {"engine": "mujoco_warp"}}}
    asked = [
        ray_cluster.gpus(content, names) for names in ([], ["delta", "clusters"], ["refine"], ["refine", "experts"])
    ]
    assert asked == [0, 0, 1, 4]


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


def test_without_a_cluster_nothing_of_ray_is_imported():
    code = "import sys, flows.loop, flows.demo, flows.walk\nassert not {'ray', 'flows.away'} & set(sys.modules)"
    ended = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, env={**os.environ}
    )
    assert ended.returncode == 0, ended.stderr
