"""Every output of every stage of dvc.yaml reaches MLflow: as a copy, or as a line with hash, size and DVC's path."""

import hashlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from tasks import registry
from tasks.running import lineage
from tests.import_graph import call_graph, modules, reached

HOME = Path(__file__).parents[3]
STAGES = yaml.safe_load((HOME / "dvc.yaml").read_text())["stages"]
POLICY = ("policy.pt", "policy.onnx", "contract.json", "card.json", "curve.csv")
# Of one stage each: the files that its run holds, and those that its run lists.
REACHES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "motions": (
        ("data/motions/index.parquet", "data/motions/skipped.csv", "data/motions/notes.csv"),
        ("data/motions/clips/0123.parquet", "data/retargets/ab/cd.npz"),
    ),
    "filter": (
        ("data/filtered/index.parquet", "data/filtered/decisions.csv", "data/filtered/drops.csv"),
        ("data/filtered/clips/0123.parquet",),
    ),
    "seal": ((), ("data/sealed/robot.json",)),
    "cluster": (
        ("data/clusters/labels.parquet", "data/clusters/summary.json", "models/clustering/autoencoder.pt"),
        (),
    ),
    "base": (tuple(f"models/base/{name}" for name in POLICY), ()),
    "experts@c0": (tuple(f"models/experts/r0/c0/{name}" for name in POLICY), ()),
    "rollouts@after0-c0": (
        ("data/rollouts/r1/c0/model.xml", "data/rollouts/r1/c0/chosen.csv"),
        ("data/rollouts/r1/c0/rollouts/a.parquet",),
    ),
    "ingest@after0": (
        tuple(f"data/measured/r1/{name}" for name in ("model.xml", "findings.csv", "summary.json", "overview.html")),
        ("data/measured/r1/rollouts/a.parquet", "data/measured/r1/quarantine/b.parquet"),
    ),
    "gate@after0": (("data/gates/round-1.json",), ()),
    "diagnose@after0": (
        tuple(f"data/diagnosis/r1/{name}" for name in ("diagnosis.json", "model.xml", "effects.yaml", "report.html")),
        (),
    ),
    "compensate@after0": (("models/compensation/r1/compensation.json",), ()),
    "delta@after0-c0": (("models/delta/r1/c0/delta.pt", "models/delta/r1/c0/card.json"), ()),
    "refine@after0-c0": (tuple(f"models/experts/r1/c0/{name}" for name in POLICY), ()),
    "control@after0-c0-delta": (
        ("models/control/r1/c0/delta/action/card.json", "models/control/r1/c0/delta/policy/policy.onnx"),
        (),
    ),
    "distill": (tuple(f"models/generalist/{name}" for name in POLICY), ()),
    "evaluate": (("data/evaluation/contract.json", "data/evaluation/episodes.parquet"), ()),
    "publish": (("data/published.json",), ()),
    "report": (("reports/report.html",), ()),
}


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The checkout's stages, with what they make as above."""
    from dvc.repo import Repo

    folder = tmp_path_factory.mktemp("outputs") / "lab"
    folder.mkdir()
    Repo.init(str(folder), no_scm=True).close()
    for name in ("dvc.yaml", "params.yaml"):
        shutil.copy(HOME / name, folder / name)
    for copied, listed in REACHES.values():
        for name in (*copied, *listed):
            file = folder / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(f"what {name} says")
    return folder


Logged = Callable[[str], tuple[set[str], dict[str, dict]]]


@pytest.fixture
def logged(workspace: Path, monkeypatch: pytest.MonkeyPatch) -> Logged:
    """The files that the run of a stage holds, and its manifest by path."""
    monkeypatch.chdir(workspace)

    def of(stage: str) -> tuple[set[str], dict[str, dict]]:
        monkeypatch.setenv("DVC_STAGE", stage)
        monkeypatch.setattr(lineage, "path_hash", lambda path: "not asked here")  # of the inputs
        lineage.current_stage.cache_clear()
        run = registry.log_run(stage, None, None, None, {}, None, {})
        lineage.current_stage.cache_clear()
        held = Path(".servers/artifacts/runs", run, "artifacts")
        files = {file.relative_to(held).as_posix() for file in held.rglob("*") if file.is_file()}
        table = json.loads((held / "outputs.json").read_text())
        return files - {"lineage.json", "outputs.json"}, {out["path"]: out for out in table["outputs"]}

    return of


def test_the_table_above_has_every_stage_of_dvc_yaml():
    assert {name.partition("@")[0] for name in REACHES} == set(STAGES)


@pytest.mark.parametrize("stage", REACHES)
def test_every_output_of_a_stage_reaches_mlflow(stage: str, logged: Logged, workspace: Path):
    copied, listed = REACHES[stage]
    held, table = logged(stage)
    assert held == set(copied)
    for name in held:
        assert (workspace / name).read_text() == f"what {name} says"
    assert len(table) == len(STAGES[stage.partition("@")[0]]["outs"])
    rows = {(path, file["path"]): file for path, out in table.items() for file in out["files"]}
    named = {f"{path}/{inside}".rstrip("/"): file["copied"] for (path, inside), file in rows.items()}
    assert named == dict.fromkeys(copied, True) | dict.fromkeys(listed, False)


def test_the_manifest_has_dvcs_hashes_and_the_sizes(logged: Logged, workspace: Path):
    _, table = logged("motions")
    motions = table["data/motions"]
    assert motions["md5"] == lineage.listing_hash(lineage.file_hashes(workspace / "data/motions"))
    assert motions["md5"].endswith(".dir")
    assert motions["bytes"] == sum(f.stat().st_size for f in (workspace / "data/motions").rglob("*") if f.is_file())
    gate, text = logged("gate@after0")[1]["data/gates/round-1.json"], b"what data/gates/round-1.json says"
    assert (gate["md5"], gate["bytes"]) == (hashlib.md5(text).hexdigest(), len(text))


@pytest.mark.parametrize("stage", STAGES)
def test_every_stage_logs_a_run(stage: str):
    """By itself, or by what trains its policy."""
    start, known = f"tasks.{stage}", modules(HOME)
    called = {start} | reached(call_graph(HOME), start)
    texts = [known[name].read_text() for name in called if name.startswith("tasks.") and name != "tasks.running.stage"]
    assert any("    log_run(" in text for text in texts), f"tasks/{stage}.py: end with log_run(...)"
