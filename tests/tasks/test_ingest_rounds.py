"""The stage ingest in a workspace of its own: what it takes, sets aside, names and refuses in a round."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bumblebee.errors import BadInput
from bumblebee.measured.rollout import read_rollout, write_rollout
from bumblebee.robot.facts import joints
from bumblebee.robot.model import gains
from tasks import ingest
from tests.measured.simulated import g1_rollout
from tests.tasks.rounds import Setup, two_clusters

workspace = pytest.fixture(two_clusters)


def test_a_round_without_one_good_file_fails_and_keeps_what_was_found(workspace: Setup) -> None:
    workspace(bad=("c0", "c1"))
    with pytest.raises(BadInput, match=r"2 files that all fail.*data/rejected/r1") as failed:
        ingest.main(1)
    assert "\n" not in str(failed.value)
    assert not Path("data/approvals").exists()
    assert not any(path.is_file() for path in Path("data/measured").rglob("*"))
    kept = Path("data/rejected/r1")
    assert {path.name for path in kept.iterdir()} == {"findings.csv", "overview.html", "quarantine"}
    assert len(list((kept / "quarantine").glob("*.parquet"))) == 2
    assert "finite" in (kept / "findings.csv").read_text()


def test_an_accepted_round_takes_away_what_an_earlier_try_left(workspace: Setup) -> None:
    workspace(bad=("c0", "c1"))
    with pytest.raises(BadInput):
        ingest.main(1)
    shutil.rmtree("data/rollouts")
    workspace()
    ingest.main(1)
    assert not Path("data/rejected/r1").exists()


@pytest.mark.parametrize(("factor", "fatal"), [(1.1, False), (1000.0, True)])
def test_gains_other_than_declared_are_a_condition_and_absurd_ones_are_set_aside(
    workspace: Setup, factor: float, fatal: bool
) -> None:
    folder = workspace()
    (folder / "params.yaml").write_text("ingest: {}\ngate: {mode: ask}\n")
    kd = [factor * gains(joint)[1] for joint in joints()]
    rollout = g1_rollout(3, 0.1, seconds=2.0)
    rollout = replace(rollout, rollout_id="kd", meta=rollout.meta | {"kd": kd})
    write_rollout(Path("data/rollouts/r1/c0/rollouts/kd.parquet"), rollout)
    ingest.main(1)
    assert Path("data/measured/r1/quarantine/kd.parquet").exists() == fatal
    rules = json.loads(Path("data/measured/r1/summary.json").read_text())["by_rule"]
    assert set(rules) == {"gains"}  # said in both cases


def test_models_that_differ_between_clusters_are_named(workspace: Setup) -> None:
    workspace()
    for cluster in ("c0", "c1"):
        Path(f"data/rollouts/r1/{cluster}/model.xml").write_text(f"<mujoco model='{cluster}'/>")
    with pytest.raises(BadInput, match="same model"):
        ingest.main(1)


def test_files_that_name_no_cluster_get_their_folders_in_our_copies_alone(workspace: Setup) -> None:
    """All clusters' rollouts lie together after it; what a person made lies where it was, to the byte."""
    workspace()
    for cluster in ("c0", "c1"):
        nameless(Path(f"data/rollouts/r1/{cluster}/rollouts"))
    before = {path: path.read_bytes() for path in Path("data/rollouts").rglob("*.parquet")}
    ingest.main(1)
    copies = [read_rollout(path) for path in sorted(Path("data/measured/r1/rollouts").iterdir())]
    assert [copy.meta["cluster"] for copy in copies] == ["c0", "c1"]
    assert {path: path.read_bytes() for path in before} == before
    originals = {read_rollout(path).rollout_id: read_rollout(path) for path in before}
    for copy in copies:
        original = originals[copy.rollout_id]
        assert copy.columns == original.columns and copy.meta == original.meta | {"cluster": copy.meta["cluster"]}
        assert all(np.array_equal(getattr(copy, c), getattr(original, c)) for c in ("time", *copy.columns))
    summary = json.loads(Path("data/measured/r1/summary.json").read_text())
    assert set(summary["by_cluster"]) == {"c0", "c1"} and {file["cluster"] for file in summary["files"]} == {"c0", "c1"}
    assert not list(Path("data/measured/r1").glob("*.parquet"))


def test_one_folder_of_everything_says_no_cluster(workspace: Setup) -> None:
    """The folder of a round is nobody's: its files are taken as they are."""
    workspace()
    shutil.move("data/rollouts/r1/c0/rollouts", "data/rollouts/r1/rollouts")
    shutil.rmtree("data/rollouts/r1/c0")
    shutil.rmtree("data/rollouts/r1/c1")
    nameless(Path("data/rollouts/r1/rollouts"))
    ingest.main(1)
    [copy] = Path("data/measured/r1/rollouts").iterdir()
    assert copy.read_bytes() == Path("data/rollouts/r1/rollouts", copy.name).read_bytes()


def nameless(folder: Path) -> None:
    """Take the cluster out of the metadata of the rollouts in a folder."""
    for path in folder.iterdir():
        rollout = read_rollout(path)
        path.unlink()
        write_rollout(path, replace(rollout, meta={k: v for k, v in rollout.meta.items() if k != "cluster"}))


@pytest.mark.parametrize(
    ("text", "named"),
    [("[1]", "JSON object"), ('{"joints": 5}', "joints"), ('{"joints": ["a"], "kp": ["b"]}', "kp"), ("{", "JSON")],
)
def test_a_broken_policy_contract_beside_the_rollouts_is_one_line(workspace: Setup, text: str, named: str) -> None:
    workspace()
    Path("data/rollouts/r1/c0/contract.json").write_text(text)
    with pytest.raises(BadInput, match=rf"contract\.json.*{named}"):
        ingest.main(1)


@pytest.mark.parametrize("pattern", ["data/{", "{0}", "{cluster}", "{round.x}"])
def test_a_pattern_with_other_fields_is_one_line(pattern: str) -> None:
    with pytest.raises(BadInput, match=r"ingest\.incoming"):
        ingest.incoming_of(pattern, 1)
