"""The method's run: who waits for whom, who learns from what, and every step once with nothing in it."""

import argparse
import json
import shutil
from dataclasses import fields, replace
from pathlib import Path

import pandas as pd
import pytest
import torch

from benchmarks.method import __main__ as command
from benchmarks.method import work
from benchmarks.method.on_robot import OnRobot, recorded_motions
from benchmarks.method.places import ARMS, BASE, GENERAL, LONGER, ONE, OWN, RANDOM, Place, experts, student
from benchmarks.method.plan import Plan
from benchmarks.method.settings import NAMED, SMALL, Method
from benchmarks.method.students import AHEAD, CHANGED, USUAL, changed, is_student, student_of
from benchmarks.method.tables import _alike, method_tables
from benchmarks.method.training import Training, correction
from benchmarks.method.trying import Experts
from benchmarks.study.motions import read_motions
from bumblebee.errors import BadInput
from bumblebee.learning import pretrained
from bumblebee.learning.policy import load_policy
from tasks.registry import experiment_name, prepare
from tasks.running.lineage import path_hash
from tests.benchmarks.study import study_folder

CLUSTERS = ["c0", "c1"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six short motions in two clusters, one of each held out; a robot without effects."""
    folder = tmp_path_factory.mktemp("method")
    study_folder.fill(folder)
    shutil.copy(folder / "robots" / "declared.json", folder / "robots" / "robot-0.json")
    return folder


def plan_of(robots: list[str]) -> dict[str, set[str]]:
    """Each step's name -> all that it waits for, directly or not."""
    steps = {step.name: step for step in Plan(Path("out"), CLUSTERS, robots, Method(shards=1), ()).steps}

    def before(name: str) -> set[str]:
        own = set(steps[name].needs)
        return own.union(*(before(need) for need in own)) if own else own

    assert len({step.done for step in steps.values()}) == len(steps)
    return {name: before(name) for name in steps}


def test_a_round_waits_for_the_recordings_of_all_experts_and_an_expert_for_its_own_correction() -> None:
    before = plan_of(["robot-0", "robot-1"])
    experts_of_all = {f"train {OWN}/c0", f"train {OWN}/c1", f"train {BASE}"}
    assert before["record robot-0/own/r1 0"] == experts_of_all
    assert before["train robot-0/physics/r1/c0"] == experts_of_all | {
        "record robot-0/own/r1 0",
        "diagnosis robot-0/own/r1",
    }
    delta = before["train robot-0/delta/r1/c0"]
    assert "delta robot-0/delta/r1/c0" in delta and "delta robot-0/delta/r1/c1" not in delta
    assert "diagnosis robot-0/own/r1" not in delta
    both = before["train robot-0/both/r2/c1"]
    assert {"diagnosis robot-0/both/r2", "delta robot-0/both/r2/c1", "train robot-0/both/r1/c0"} <= both
    assert not any("robot-1" in name or "/physics/" in name for name in both)
    assert {f"train robot-0/delta/r2/{cluster}" for cluster in CLUSTERS} <= before["distil robot-0/delta/student"]


def test_without_robots_the_controls_are_left() -> None:
    before = plan_of([])
    assert {name.split()[0] for name in before} == {"train", "distil", "tried"}
    assert before[f"distil {student(GENERAL)}"] == {f"train {BASE}"}
    assert f"train {OWN}/c0" in before[f"train {LONGER}/c0"]
    assert f"train {RANDOM}/r1" in before[f"distil {student(RANDOM)}"]


def test_every_row_has_as_many_iterations(folder: Path) -> None:
    method, motions = Method(), read_motions(folder)
    training = Training(method, motions, Path("out"), lambda: False)

    def spent(name: str) -> int:
        own = training._config(name).iterations
        return own if training._parent(name) == BASE else own + spent(training._parent(name))

    each = method.expert + method.rounds * method.refine
    ends = [experts(line, CLUSTERS, method.rounds)[0] for line in (LONGER, RANDOM, *(f"robot-0/{arm}" for arm in ARMS))]
    assert [spent(name) for name in ends] == [each] * len(ends)
    assert spent(ONE) == each * len(CLUSTERS)


def test_an_expert_learns_in_its_own_correction() -> None:
    out = Path("out")
    assert correction(out, f"{OWN}/c0").diagnosis is None and correction(out, f"{OWN}/c0").adapter() is None
    found = correction(out, "robot-0/both/r2/c1")
    assert found.diagnosis == out / "robot-0/both/r2/diagnosis"
    assert found.delta == out / "robot-0/both/r2/c1/delta"
    assert correction(out, "robot-0/physics/r1/c1").diagnosis == out / "robot-0/own/r1/diagnosis"
    assert correction(out, "robot-0/delta/r1/c1").diagnosis is None


def test_every_second_motion_of_a_cluster_judges_and_a_cluster_of_one_is_refused(folder: Path) -> None:
    motions = read_motions(folder)
    assert [len(names) for names in recorded_motions(motions, 20).values()] == [2, 2]
    with pytest.raises(BadInput, match="cluster c0: expected at least 2 motions to record"):
        recorded_motions(motions, 1)


def test_experts_side_by_side_each_move_the_robots_of_their_own_motions() -> None:
    first, second = load_policy(pretrained.FOLDER), load_policy(pretrained.FOLDER / "randomised")
    seen = torch.randn(3, first.shape.observation)
    actions = Experts([first, second], [1, 0, 1]).follower()(seen)
    assert torch.allclose(actions[1], first(seen[1:2])[0], atol=1e-6)
    assert torch.allclose(actions[[0, 2]], second(seen[[0, 2]]), atol=1e-6)


def test_a_row_for_one_robot_stands_beside_that_robots_rows_and_a_control_beside_all() -> None:
    tried = [("delta", 0), ("physics", 0), ("physics", 1), (LONGER, 0)]
    rows = pd.DataFrame([(arm, seed, "drawn", name) for arm, seed in tried for name in "ab"])
    rows.columns = ["arm", "seed", "robot", "name"]
    assert set(_alike(rows, "delta", "physics")["seed"]) == {0}
    assert _alike(rows, "physics", LONGER).groupby("arm")["seed"].agg(set).to_dict() == {
        "physics": {0, 1},
        LONGER: {0, 1},
    }
    assert _alike(rows, "both", LONGER).empty


def test_a_changed_student_differs_in_one_thing_and_its_folder_says_in_which() -> None:
    for name, each in CHANGED.items():
        assert student_of(changed("robot-0/both", name)) == ("robot-0/both", each)
        assert sum(getattr(each, field.name) != getattr(USUAL, field.name) for field in fields(USUAL)) == 2  # and title
    assert student_of(student(OWN)) == (OWN, USUAL)
    assert is_student(changed(ONE, AHEAD)) and not is_student(f"{OWN}/c0")


def test_no_sealed_robot_is_one_line(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="sealed robots"):
        command.sealed_robots(tmp_path)
    assert list(command.sealed_robots(folder / "robots")) == ["robot-0"]


def recorded_with_hashes(folder: Path, out: Path, robots: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The table goes into the registry with the hash of each policy, and only from below the working folder."""
    monkeypatch.chdir(folder)
    given = [str(out), "--motions", str(folder), "--robots", str(robots), "--settings", "small", "--record"]
    with pytest.raises(BadInput, match="--out: expected a file below"):
        command.write_table(command.parse(["table", *given, "--out", str(folder.parent / "elsewhere.md")]))
    assert not (folder.parent / "elsewhere.md").exists()
    command.write_table(command.parse(["table", *given, "--out", "method.md"]))
    client = prepare()
    experiment = client.get_experiment_by_name(experiment_name())
    assert experiment is not None
    (run,) = client.search_runs([experiment.experiment_id], "tags.stage = 'method'")
    listed = json.loads(
        Path(client.download_artifacts(run.info.run_id, "method.md.hashes.json", str(folder))).read_text()
    )
    assert listed["robot-0/delta/r1/c0/policy.pt"] == path_hash(out / "robot-0/delta/r1/c0/policy.pt")
    assert listed["robot-0/own/r1/record-0"].endswith(".dir")
    assert 0 <= run.data.metrics["Transformers/sealed/held out/BumbleBee"] <= 1


@pytest.mark.slow
def test_every_step_runs_and_is_made_into_tables(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    method = replace(SMALL, rounds=1)
    monkeypatch.setitem(NAMED, "small", method)
    motions, out, robots = read_motions(folder), folder / "out", folder / "robots"
    arguments = ["run", "--motions", str(folder), "--robots", str(robots), "--settings", "small", "--out", str(out)]
    steps = command.begun(command.parse(arguments), method, motions)
    for step in steps:
        kind, where, *rest = step.command[1:]
        given = {"settings": "small", "seed": 0, "motions": folder, "robots": robots, "out": out}
        own = argparse.Namespace(kind=kind, where=where, **given)
        shard, robot = ("--shard" in rest, "--robot" in rest)
        own.shard, own.seconds = 0 if not shard else int(rest[rest.index("--shard") + 1]), None
        own.robot = rest[rest.index("--robot") + 1] if robot else None
        assert work.do(own)
        assert step.done.exists(), step.name
    text = method_tables(out, method, motions, robots)
    for told in (
        "**BumbleBee**: delta actions",
        "random clusters",
        "general delta",
        "| robot-0 | nothing | own | r1 |",
    ):
        assert told in text
    assert text.count("| held out | 2 |") >= 3 * (7 + 7)
    assert "| sees what the experts see; an MLP" in text
    recorded_with_hashes(folder, out, robots, monkeypatch)
    errors = pd.read_csv(out / "robot-0" / "own" / "r1" / "errors.csv")
    assert set(errors["correction"]) == {"declared", "general delta", "delta", "physics", "both"}
    assert json.loads((out / student("robot-0/delta") / "done.json").read_text())["frames"] > 0
    assert OnRobot(method, motions, out, robots).recorded["c0"]
    assert Place.of("robot-0/delta/r1/c0").name == "robot-0/delta/r1"
