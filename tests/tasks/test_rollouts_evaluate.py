"""The stages that run policies, on a workspace of three short clips and a policy that follows blindly."""

import json
import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bumblebee.errors import BadInput
from bumblebee.learning.export import write_export
from bumblebee.measured.rollout import Rollout, read_dataset, read_rollout, write_rollout
from bumblebee.measured.wire_note import noted_latency
from bumblebee.motion.store import write_library
from bumblebee.tracking.sampling.library import AHEAD
from tasks import evaluate, ingest, report, rollouts, seal
from tasks.running import paths
from tasks.sections import Loop, Round
from tests.policy.conftest import linear_onnx, nod

PARAMS = """
clusters: [c0, c1]
rounds: [{n: 1, parent: 0}]
seal: {seed: 3, loses: 0, stands: 0, draws: 1, threads: 1}
rollouts: {motions: 1, repeats: 2, threads: 1}
control: {}
evaluate: {threads: 1}
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace as it is before the first round's rollouts."""
    root = tmp_path_factory.mktemp("workspace")
    (root / "params.yaml").write_text(PARAMS)
    clips = [nod("a", 10), nod("b", 14), nod("far", 12, split="test")]
    write_library(root / "data/filtered", clips)
    (root / "data/clusters").mkdir()
    labels = pd.DataFrame({"name": ["a", "b", "far"], "cluster": ["c0", "c0", "c1"], "x": 0.0, "y": 0.0})
    labels.to_parquet(root / "data/clusters/labels.parquet")
    for folder in ("models/base", "models/experts/r0/c0", "models/experts/r0/c1"):
        (root / folder).mkdir(parents=True)
        write_export(root / folder, linear_onnx(0.0), AHEAD)
    return root


@pytest.fixture
def workspace(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of it to work in, without MLflow."""
    shutil.copytree(made, tmp_path / "work")
    monkeypatch.chdir(tmp_path / "work")
    for module in (rollouts, evaluate, ingest):
        monkeypatch.setattr(module, "log_run", lambda *_, **__: None)
    return tmp_path / "work"


@pytest.fixture(scope="module")
def sealed(made: Path) -> Callable[..., None]:
    """A function that puts what the stage seal made of a seed into the working folder; the stage runs once a seed."""

    @cache
    def robot(seed: int) -> bytes:
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(made)
            (made / "params.yaml").write_text(PARAMS.replace("seed: 3,", f"seed: {seed},"))
            seal.main()
        (made / "params.yaml").write_text(PARAMS)
        found = (made / paths.SEALED_ROBOT).read_bytes()
        shutil.rmtree((made / paths.SEALED_ROBOT).parent)
        return found

    def put(seed: int = 3) -> None:
        paths.SEALED_ROBOT.parent.mkdir(parents=True, exist_ok=True)
        paths.SEALED_ROBOT.write_bytes(robot(seed))

    return put


def test_a_round_of_one_cluster_gives_a_dataset_of_the_contract(workspace: Path, sealed: Callable[..., None]) -> None:
    sealed()
    rollouts.main(round=1, cluster="c0")
    dataset = read_dataset(workspace / "data/rollouts/r1/c0")
    chosen = pd.read_csv(workspace / "data/rollouts/r1/c0/chosen.csv")
    assert dataset.model_path is not None and len(dataset.rollouts) == 2
    assert chosen["run"].sum() == 1 and chosen["success"].all()
    assert {r.meta["motion"] for r in dataset.rollouts} == set(chosen["motion"][chosen["run"]]) <= {"a", "b"}
    assert {r.meta["policy"]["version"] for r in dataset.rollouts} == {"r0"}
    assert not np.array_equal(dataset.rollouts[0].joint_pos, dataset.rollouts[1].joint_pos)


@pytest.mark.parametrize("base", ["odometry", "none"])
def test_the_stand_in_logs_the_place_that_it_is_said_to_know(
    base: str, workspace: Path, sealed: Callable[..., None]
) -> None:
    (workspace / "params.yaml").write_text(PARAMS.replace("motions: 1,", f"motions: 1, base: {base},"))
    sealed()
    rollouts.main(round=1, cluster="c0")
    for rollout in read_dataset(workspace / "data/rollouts/r1/c0").rollouts:
        assert (rollout.base_pos is None) == (base == "none")
        if base == "odometry":  # smooth, where motion capture jumps by a millimetre
            assert np.abs(np.diff(rollout.base_pos, n=2, axis=0)).max() < 0.002


def test_without_a_sealed_robot_the_stage_says_so_and_leaves_nothing(workspace: Path) -> None:
    with pytest.raises(BadInput, match=r"data/sealed/robot\.json"):
        rollouts.main(round=1, cluster="c0")
    assert not list((workspace / "data/rollouts/r1").glob("*"))


def test_held_out_motions_are_not_run(workspace: Path) -> None:
    with pytest.raises(BadInput, match="c1 in the train split"):
        rollouts.main(round=1, cluster="c1")


def test_a_round_that_is_not_in_params_is_refused(workspace: Path) -> None:
    with pytest.raises(BadInput, match="n: 7"):
        rollouts.main(round=7, cluster="c0")


def test_the_users_own_files_take_the_stand_ins_place(workspace: Path) -> None:
    own = workspace / "mine/r1/c0"
    own.mkdir(parents=True)
    (own / "walk.parquet").write_bytes(b"whatever the robot wrote")
    (workspace / "params.yaml").write_text(PARAMS.replace("motions: 1,", "motions: 1, source: mine,"))
    rollouts.main(round=1, cluster="c0")
    copied = workspace / "data/rollouts/r1/c0"
    assert (copied / "rollouts/walk.parquet").read_bytes() == (own / "walk.parquet").read_bytes()
    assert (copied / "model.xml").exists()
    with pytest.raises(BadInput, match="mine/r1/c1"):
        rollouts.main(round=1, cluster="c1")


def test_the_users_files_are_of_the_cluster_in_whose_folder_they_lie(workspace: Path) -> None:
    """A copy names it where the file names none; the file itself is left alone, and one that names it is no other."""
    own = workspace / "mine/r1/c0/rollouts"
    for number, meta in enumerate(({}, {"cluster": "c0"}, {"cluster": ""}, {"cluster": None})):
        write_rollout(own / f"walk{number}.parquet", brief(f"walk{number}", {"operator": "Ann", **meta}))
    before = {path.name: path.read_bytes() for path in own.iterdir()}
    (workspace / "params.yaml").write_text(PARAMS.replace("motions: 1,", "motions: 1, source: mine,"))
    rollouts.main(round=1, cluster="c0")
    copies = workspace / "data/rollouts/r1/c0/rollouts"
    for path in sorted(copies.iterdir()):
        assert read_rollout(path).meta == {"operator": "Ann", "cluster": "c0"}
    assert len(list(copies.iterdir())) == 4 and {path.name: path.read_bytes() for path in own.iterdir()} == before
    assert (copies / "walk1.parquet").read_bytes() == before["walk1.parquet"]


@pytest.mark.parametrize("named", ["c1", 0.5, ["c0"]])
def test_a_users_file_that_names_another_cluster_than_its_folder_is_refused(workspace: Path, named: object) -> None:
    """One line with file and both names; nothing of the round is left."""
    own = workspace / "mine/r1/c0"
    write_rollout(own / "a.parquet", brief("a", {}))
    write_rollout(own / "b.parquet", brief("b", {"cluster": named}))
    (workspace / "params.yaml").write_text(PARAMS.replace("motions: 1,", "motions: 1, source: mine,"))
    with pytest.raises(BadInput) as refused:
        rollouts.main(round=1, cluster="c0")
    line = str(refused.value)
    assert "b.parquet: metadata: cluster: expected 'c0'" in line and f"came {named!r}" in line and "\n" not in line
    assert not list((workspace / "data/rollouts/r1").glob("*"))


def brief(name: str, meta: dict[str, object]) -> Rollout:
    """Three ticks of one joint."""
    still = np.zeros((3, 1))
    return Rollout(name, ("knee",), 50.0, np.arange(3) / 50, still, still, joint_target=still, meta=meta)


def test_evaluation_covers_policies_engines_and_splits(workspace: Path, sealed: Callable[..., None]) -> None:
    sealed()
    evaluate.main()
    summary = json.loads((workspace / "data/evaluation/summary.json").read_text())
    episodes = pd.read_parquet(workspace / "data/evaluation/episodes.parquet")
    counts = episodes.groupby(["engine", "policy"]).size().to_dict()
    for engine in ("nominal", "stand_in"):
        assert {name: counts[engine, name] for name in ("untrained", "base", "expert-c0-r0", "expert-c1-r0")} == {
            "untrained": 3,
            "base": 3,
            "expert-c0-r0": 2,
            "expert-c1-r0": 1,
        }
    assert episodes[episodes["policy"] == "base"]["success"].all()
    assert set(episodes["split"]) == {"train", "test"}
    assert set(summary["missing"]) == {"generalist", "expert-c0-r1", "expert-c1-r1"}
    same = [c for c in summary["comparisons"] if (c["from"], c["to"]) == ("base", "experts-r0") and c["split"] == "all"]
    assert {c["engine"] for c in same} == {"nominal", "stand_in"}
    assert all(c["success"]["value"] == 0.0 and c["success"]["p"] == 1.0 for c in same)
    contract = json.loads((workspace / "data/evaluation/contract.json").read_text())
    assert summary["contract_sha256"] == contract["sha256"]
    assert contract["engines"]["nominal"]["timestep"] > contract["engines"]["stand_in"]["timestep"]


def test_another_sealed_robot_is_another_contract(workspace: Path, sealed: Callable[..., None]) -> None:
    """Success on two different stand-ins is not comparable; on the declared model alone it is."""
    clips, hashes = [nod("a", 10)], {}
    for engines in (("nominal",), ("nominal", "stand_in")):
        for seed in (3, 4):
            sealed(seed)
            hashes[engines, seed] = evaluate.frozen(clips, evaluate.EvaluateConfig(engines=engines)).sha256
    assert hashes[("nominal",), 3] == hashes[("nominal",), 4]
    assert hashes[("nominal", "stand_in"), 3] != hashes[("nominal", "stand_in"), 4]


def test_it_repeats_itself_and_refuses_another_contract_than_the_wanted_one(workspace: Path) -> None:
    (workspace / "params.yaml").write_text(
        PARAMS.replace("{threads: 1}", "{threads: 1, engines: [nominal], untrained: false}")
    )
    evaluate.main()
    first = pd.read_parquet(workspace / "data/evaluation/episodes.parquet")
    evaluate.main()
    assert pd.read_parquet(workspace / "data/evaluation/episodes.parquet").equals(first)
    wanted = json.loads((workspace / "data/evaluation/contract.json").read_text())["sha256"]
    changed = f"{{threads: 1, engines: [nominal], seeds: [1], contract: {wanted}}}"
    (workspace / "params.yaml").write_text(PARAMS.replace("evaluate: {threads: 1}", f"evaluate: {changed}"))
    before = (workspace / "data/evaluation/summary.json").read_bytes()
    with pytest.raises(BadInput, match="seeds"):
        evaluate.main()
    assert (workspace / "data/evaluation/summary.json").read_bytes() == before


def test_an_unknown_engine_is_named(workspace: Path) -> None:
    (workspace / "params.yaml").write_text(PARAMS.replace("{threads: 1}", "{engines: [gazebo]}"))
    with pytest.raises(BadInput, match="gazebo"):
        evaluate.main()


def test_an_experts_success_is_one_curve_over_the_rounds() -> None:
    def row(policy: str, round: int | None, value: float, split: str = "all") -> dict:
        about = {"policy": policy, "round": round, "engine": "nominal", "split": split, "group": "all"}
        return {**about, "success": {"value": value}}

    experts = [row("expert-c0-r0", 0, 0.2), row("expert-c0-r1", 1, 0.6)]
    rows = [*experts, row("base", None, 0.1), row("base", None, 0.0, "test")]
    assert evaluate.headline({"results": rows}) == {
        "nominal/expert-c0/success": {0: 0.2, 1: 0.6},
        "nominal/base/success": {0: 0.1},
    }


def test_a_round_over_the_wire_is_taken_in_as_any_other(workspace: Path, sealed: Callable[..., None]) -> None:
    over_wire = PARAMS.replace("motions: 1, repeats: 2,", "motions: 1, repeats: 1, wire: lcm,")
    (workspace / "params.yaml").write_text(f"{over_wire}ingest: {{}}\ngate: {{}}\n")
    sealed()
    rollouts.main(round=1, cluster="c0")
    (rollout,) = read_dataset(workspace / "data/rollouts/r1/c0").rollouts
    noted = noted_latency(rollout.meta["notes"])
    assert noted and report.wire_latency(Loop(("c0",), (Round(1, 0),), 1)) == noted and rollout.base_pos is None
    ingest.main(round=1)
    taken = json.loads((paths.measured(1) / "summary.json").read_text())
    assert (taken["accepted"], taken["quarantined"]) == (1, 0)
