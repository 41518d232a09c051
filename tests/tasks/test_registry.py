"""MLflow's one module: what a stage leaves in the history, and models that can be loaded by their alias."""

import hashlib
import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
import yaml

from tasks import registry
from tasks.running import lineage, run_form


@dataclass(frozen=True)
class Inner:
    clip: float = 0.2


@dataclass(frozen=True)
class Config:
    steps: int = 4
    ppo: Inner = field(default_factory=Inner)


def policy_folder(folder: Path, gain: float) -> Path:
    """A policy of one multiplication, with the files that the registry reads."""
    from onnx import TensorProto, helper, numpy_helper

    weights = [numpy_helper.from_array(np.full((5, 2), gain, np.float32), "w")]
    nodes = [helper.make_node("MatMul", ["obs", "w"], ["actions"])]
    ends = [helper.make_tensor_value_info(n, TensorProto.FLOAT, ["N", k]) for n, k in (("obs", 5), ("actions", 2))]
    graph = helper.make_graph(nodes, "policy", ends[:1], ends[1:], weights)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])
    model.ir_version = 8
    folder.mkdir()
    (folder / "policy.onnx").write_bytes(model.SerializeToString())
    (folder / "contract.json").write_text(json.dumps({"schema": 1, "joints": ["a", "b"]}))
    return folder


@pytest.fixture
def workspace(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path_factory.mktemp("registry") / "lab"
    folder.mkdir()
    monkeypatch.chdir(folder)
    return folder


def test_settings_are_flattened_with_dots():
    assert run_form.flatten(Config()) == {"steps": "4", "ppo.clip": "0.2"}
    assert run_form.flatten(None) == {}


def test_a_curve_is_read_column_by_column_without_its_gaps(tmp_path: Path):
    file = tmp_path / "curve.csv"
    file.write_text("step,loss,kl\n0,2.0,\n10,1.0,0.5\n20,nan,x\n")
    assert run_form.read_curve(file) == [("loss", 0, 2.0), ("loss", 10, 1.0), ("kl", 10, 0.5)]


def test_dvc_hash_of_a_folder_is_dvcs_own(tmp_path: Path):
    """The listing that DVC hashes: sorted relative paths with their MD5."""
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "x").write_text("1")
    (tmp_path / "a").write_text("2")
    md5 = {text: hashlib.md5(text.encode()).hexdigest() for text in ("1", "2")}
    listing = [{"md5": md5["2"], "relpath": "a"}, {"md5": md5["1"], "relpath": "b/x"}]
    assert lineage.path_hash(tmp_path) == hashlib.md5(json.dumps(listing).encode()).hexdigest() + ".dir"
    assert lineage.path_hash(tmp_path / "nothing") == "missing"


def test_runs_and_models_can_be_found_again_even_when_the_workspace_has_moved(
    workspace: Path, monkeypatch: pytest.MonkeyPatch
):
    """One run of a stage and two versions of a model; then the folder gets another name and all is still there."""
    curve = Path("curve.csv")
    curve.write_text("step,loss\n0,2.0\n1,1.0\n")
    begun = time.time() - 90
    run_id = registry.log_run("base", None, 0, Config(), {"success": 0.5}, curve, {"note": "x"}, [curve], begun)
    first = registry.register(
        "generalist", policy_folder(workspace / "p1", 2.0), {"onnx_sha256": "1"}, {"success": 0.5}
    )
    second = registry.register(
        "generalist", policy_folder(workspace / "p2", 3.0), {"onnx_sha256": "2"}, {"success": None}
    )
    again = registry.register("generalist", workspace / "p1", {"onnx_sha256": "1"}, {"success": 0.5})
    assert (first, second, again) == ("1", "2", "1")
    assert registry.champion_version("generalist") is None
    tags = registry.version_tags("generalist", second)
    assert tags is not None and tags["onnx_sha256"] == "2"
    assert registry.version_tags("generalist", "9") is None and registry.version_card("generalist", second) == ""
    registry.set_alias("generalist", "champion", second)
    registry.set_alias("generalist", "champion", first)

    moved = workspace.with_name("moved")
    workspace.rename(moved)
    monkeypatch.chdir(moved)
    client = registry.prepare()
    run = client.get_run(run_id)
    assert (run.info.start_time, run.info.end_time >= int(1000 * begun) + 90_000) == (int(1000 * begun), True)
    assert run.data.params["ppo.clip"] == "0.2"
    assert [point.value for point in client.get_metric_history(run_id, "loss")] == [2.0, 1.0]
    own = {name for name in run.data.tags if not name.startswith("mlflow.")}
    assert own == {"stage", "round", "note", "git_sha", "dvc_stage", "lineage", "record"}, "a few that help"
    whole = Path(".servers/artifacts/runs", run_id, "artifacts/lineage.json").read_bytes()
    assert hashlib.sha256(whole).hexdigest() == run.data.tags["lineage"]
    assert json.loads(whole)["settings"] == {"steps": "4", "ppo.clip": "0.2"}
    assert run.info.artifact_uri.startswith("mlflow-artifacts:/")
    tags = registry.champion_tags("generalist")
    assert tags is not None and tags["onnx_sha256"] == "1" and "git_sha" in tags

    import mlflow

    loaded = mlflow.pyfunc.load_model("models:/generalist@champion")
    assert np.allclose(loaded.predict({"obs": np.ones((1, 5), np.float32)})["actions"], 10.0)
    with pytest.raises(mlflow.exceptions.MlflowException, match="shape"):
        loaded.predict({"obs": np.ones((1, 4), np.float32)})


def test_a_stage_that_dvc_repeats_with_equal_inputs_has_one_record(
    workspace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed after its record was written, or amid it; other inputs and another workspace have their own."""
    from dvc.repo import Repo

    Repo.init(str(workspace), no_scm=True).close()
    (workspace / "dvc.yaml").write_text("stages: {base: {cmd: 'true', deps: [data]}}\n")
    (workspace / "data").write_text("1")
    monkeypatch.setenv("DVC_STAGE", "base")
    client, known = registry.prepare(), set()

    def log(curve: Path | None = None) -> set[str]:
        lineage.current_stage.cache_clear()
        registry.log_run("base", None, 0, Config(), {"success": 0.5}, curve, {})
        experiment = client.get_experiment_by_name(workspace.name)
        return {run.info.run_id for run in client.search_runs([experiment.experiment_id])}

    first, again = log(), log()
    assert len(first) == len(again) == 1 and first != again
    with pytest.raises(FileNotFoundError):
        log(workspace / "no-curve.csv")
    assert len(known := log()) == 1
    (workspace / "data").write_text("2")
    assert len(changed := log()) == 2 and known < changed
    monkeypatch.setenv(lineage.PLACE, "another")
    assert changed < log()


def test_upstream_is_everything_back_to_the_first_stage(tmp_path: Path) -> None:
    lock = tmp_path / "dvc.lock"
    stages = {
        "motions": {"deps": [{"path": "code", "md5": "a"}], "outs": [{"path": "data/motions", "md5": "b"}]},
        "base": {
            "deps": [{"path": "data/motions", "md5": "b"}],
            "params": {"params.yaml": {"base": {"seed": 0}}},
            "outs": [{"path": "models/base", "md5": "c"}],
        },
        "expert": {
            "deps": [{"path": "models/base", "md5": "c"}],
            "outs": [{"path": "models/experts/r0/c0", "md5": "d"}],
        },
        "generalist": {"deps": [{"path": "models/experts/r0", "md5": "e"}], "outs": [{"path": "models/generalist"}]},
        "other": {"deps": [{"path": "elsewhere", "md5": "f"}], "outs": [{"path": "data/other"}]},
    }
    lock.write_text(yaml.safe_dump({"schema": "2.0", "stages": stages}))
    found = lineage.upstream(Path("models/generalist"), lock)
    expected = {"models/experts/r0": "e", "models/base": "c", "data/motions": "b", "code": "a"}
    assert {k: v for k, v in found.items() if not k.startswith("params:")} == expected
    assert "params:base" in found
    by_path = {entry["path"]: entry for entry in lineage.history(Path("models/generalist"), lock)}
    assert by_path["models/experts/r0"] == {"path": "models/experts/r0", "md5": "e", "stage": "expert"}
    assert by_path["data/motions"]["stage"] == "motions" and "stage" not in by_path["code"]
    assert lineage.upstream(Path("models/generalist"), tmp_path / "none") == {}


@pytest.mark.parametrize(
    ("name", "kept"), [("before/", "before/unknown"), ("success/a b", "success/a b"), ("x/a:b/c", "x/a_b/c")]
)
def test_metric_names_are_such_that_mlflow_takes_them(name: str, kept: str) -> None:
    assert run_form.metric_name(name) == kept


def test_mlflow_reports_no_use_to_its_maker_whoever_asks_the_registry_first() -> None:
    """MLflow looks when it is imported, so the variable is set before."""
    code = "import sys, tasks.registry as r, os; assert 'mlflow' not in sys.modules; print(os.environ[r.NO_TELEMETRY])"
    bare = {name: value for name, value in os.environ.items() if name != registry.NO_TELEMETRY}
    said = subprocess.run([sys.executable, "-c", code], env=bare, capture_output=True, text=True, check=True)
    assert said.stdout == "true\n"
