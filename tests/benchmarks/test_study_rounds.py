"""The rounds: who waits for whom, what is learned from what, and every step once with nothing in it."""

import argparse
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.study import round_work, rounds
from benchmarks.study.correction import DECLARED
from benchmarks.study.jobs import base_of, experts_jobs
from benchmarks.study.motions import read_motions
from benchmarks.study.round_settings import SMALL_CONFIG, RoundsConfig, settings
from benchmarks.study.round_tables import paired, rounds_tables
from benchmarks.study.rounds import ARMS, BASE, Place, learned_from, plan, recorded_motions
from benchmarks.study.settings import SMALL
from benchmarks.study.training import train
from bumblebee.learning.delta import DeltaConfig
from bumblebee.learning.delta.action import RegressionConfig
from tests.benchmarks import study_folder

ROBOTS = ["declared", "robot-0"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six short motions in two clusters, one of each held out; a robot without effects."""
    folder = tmp_path_factory.mktemp("rounds")
    study_folder.fill(folder)
    return folder


def test_a_step_waits_for_all_that_it_reads() -> None:
    steps = {step.name: step for step in plan(Path("out"), ROBOTS, RoundsConfig(), ())}

    def before(name: str) -> set[str]:
        own = set(steps[name].needs)
        return own.union(*(before(need) for need in own)) if own else own

    shared = {"robot-0/base/r1/diagnosis", *(f"robot-0/base/r1/record-{i}" for i in range(4))}
    assert before("robot-0/both/r1/delta") == shared
    assert before("robot-0/none/r1/policy") == set()
    assert before("robot-0/none/r2/policy") == {"robot-0/none/r1/policy"}
    assert before("robot-0/delta/r1/delta") == shared - {"robot-0/base/r1/diagnosis"}
    second = before("robot-0/both/r2/tried-3")
    assert {"robot-0/both/r2/diagnosis", "robot-0/both/r2/delta", "robot-0/both/r1/policy"} <= second
    assert before("robot-0/base/r1/errors") == shared | {"robot-0/delta/r1/delta", "robot-0/both/r1/delta"}
    assert {step.name for step in steps.values() if step.gpu} == {
        f"{robot}/{arm}/r{round_}/{kind}"
        for robot in ROBOTS
        for round_ in (1, 2)
        for arm, parts in ARMS.items()
        for kind in ("policy", "delta")
        if kind == "policy" or "delta" in parts
    }
    assert len({step.done for step in steps.values()}) == len(steps)


def test_a_delta_action_by_regression_needs_no_gpu() -> None:
    options = rounds.parse(["table", "run", "--robots", "robots", "--out", "rounds.md", "--regression"])
    config = settings(options)[1]
    assert config.delta.method == "regression"
    steps = plan(Path("out"), ROBOTS, config, ())
    assert {step.name.rsplit("/", 1)[1] for step in steps if step.gpu} == {"policy"}
    assert not any("/r2/" in step.name for step in steps)


def test_motions_that_the_policy_follows_are_recorded_first_and_half_of_each_cluster_judges(folder: Path) -> None:
    motions = read_motions(folder)
    followed = json.loads((folder / "robots" / "followed.json").read_text())["names"]
    names = recorded_motions(motions, followed, SMALL_CONFIG)
    cluster = motions.labels.set_index("name")["cluster"]
    assert names[0] == followed[0]
    assert cluster[names].tolist() == ["c0", "c0", "c1", "c1"]
    assert cluster[learned_from(names)].tolist() == ["c0", "c1"]
    assert not set(names) & set(motions.labels[motions.labels["split"] == "test"]["name"])


def test_a_difference_is_paired_by_motion_and_seed() -> None:
    rows = pd.DataFrame(
        [(m, s, arm, s == 0 or arm == "x") for m in "abcdefgh" for s in (0, 1) for arm in ("x", "y")],
        columns=["motion", "seed", "arm", "success"],
    )
    rows = rows.sample(frac=1, random_state=0)
    value, p = paired(rows, rows["arm"] == "x", rows["arm"] == "y")
    assert value.value == pytest.approx(0.5)
    assert p < 0.01


def _options(folder: Path, place: Place) -> argparse.Namespace:
    return argparse.Namespace(
        place=place.name, motions=folder, robots=folder / "robots", out=folder / "out", shard=0, seconds=None
    )


def _work(folder: Path, kind: str, place: Place) -> None:
    round_work.DO[kind](round_work.Work(_options(folder, place), SMALL, replace(SMALL_CONFIG, rounds=1)))


@pytest.mark.slow
def test_every_step_of_a_round_runs_and_is_made_into_tables(folder: Path) -> None:
    config = replace(SMALL_CONFIG, rounds=1)
    motions, out = read_motions(folder), folder / "out"
    train(experts_jobs(SMALL, motions)[0], motions, SMALL, folder, DECLARED)
    options = rounds.parse(
        [
            *("run", str(folder / base_of(0)), "--motions", str(folder), "--robots", str(folder / "robots")),
            *("--out", str(out), "--small"),
        ]
    )
    assert rounds.begin(options, SMALL, config, motions) == ["declared"]
    for step in plan(out, ["declared"], config, ()):
        kind, place = step.command[1:3]
        _work(folder, kind, Place.of(place))
        assert step.done.exists(), step.name
    text = rounds_tables(out, folder / "robots", config)
    assert text.count("| held out | both | 2 | ") == 1 and "| round 1 | 1 less 0 |" in text
    assert "| declared | nothing | base | 1 |" in text
    errors = pd.read_csv(out / "declared" / BASE / "r1" / "errors.csv")
    assert set(errors["correction"]) == set(round_work.CORRECTIONS)
    assert np.isfinite(errors["error"]).any()
    kept = out / "declared" / "delta" / "r1" / "delta"
    shutil.rmtree(kept)
    by_regression = replace(config, delta=DeltaConfig(num_envs=8, regression=RegressionConfig(windows=100)))
    round_work.delta(round_work.Work(_options(folder, Place("declared", "delta", 1)), SMALL, by_regression))
    assert json.loads((kept / "card.json").read_text())["config"]["method"] == "regression"
    assert "held_out" in pd.read_csv(kept / "curve.csv")
    shutil.rmtree(out)
