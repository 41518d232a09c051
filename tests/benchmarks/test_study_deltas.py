"""Delta actions by cluster against a general one: each step runs, reads what it should, and ends in the tables."""

import argparse
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from benchmarks.study import delta_work, deltas, round_work, rounds
from benchmarks.study.correction import DECLARED
from benchmarks.study.delta_tables import deltas_tables
from benchmarks.study.deltas import ARMS, GENERAL, SMALL_DELTAS, delta_folder, plan
from benchmarks.study.jobs import base_of, experts_jobs
from benchmarks.study.motions import read_motions
from benchmarks.study.round_settings import SMALL_CONFIG
from benchmarks.study.rounds import Place
from benchmarks.study.settings import SMALL
from benchmarks.study.training import train
from bumblebee.errors import BadInput
from tests.benchmarks import study_folder


def test_an_arm_waits_for_its_own_delta_action_alone() -> None:
    steps = {step.name: step for step in plan(Path("out"), ["c0", "c1"], ())}
    assert steps["policy/none-c0"].needs == ()
    assert steps["policy/general-c1"].needs == ("delta/general",)
    assert steps["policy/own-c1"].needs == ("delta/c1",)
    assert steps["errors/c0"].needs == ("delta/general", "delta/c0")
    assert all(steps[f"tried/{arm}-c0"].needs == (f"policy/{arm}-c0",) for arm in ARMS)
    assert {name for name, step in steps.items() if step.gpu} == {n for n in steps if n[:5] in ("delta", "polic")}
    assert len({step.done for step in steps.values()}) == len(steps)


def test_each_arm_has_its_delta_action() -> None:
    folders = [delta_folder(Path("out"), arm, "c1") for arm in ARMS]
    assert folders == [None, Path("out/delta-general"), Path("out/delta-c1")]


def test_a_robot_that_nobody_recorded_is_one_line(tmp_path: Path) -> None:
    options = argparse.Namespace(rounds=tmp_path, robot="robot-9", out=tmp_path / "out")
    with pytest.raises(BadInput, match=r"robot-9/base/r1: expected recordings of the robot, came none"):
        deltas.begin(options, SMALL, SMALL_DELTAS, None)


def test_a_cluster_of_motions_shorter_than_an_episode_is_left_out() -> None:
    labels = pd.DataFrame({"name": ["a", "b", "c", "d"], "cluster": ["c0", "c0", "c1", "c1"]})
    seconds = {"a": 2.0, "b": 2.0, "c": 0.9, "d": 2.0}
    rollouts = [SimpleNamespace(meta={"motion": name}, duration=own) for name, own in seconds.items()]
    found = deltas.clusters_with_episodes(rollouts, ["a", "b", "c", "d"], SimpleNamespace(labels=labels), 1.0)
    assert found == ["c0"]  # c is what c1 would learn from, d judges


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Motions in two clusters, and a round's recordings of a robot without effects by a policy of a few steps."""
    folder = tmp_path_factory.mktemp("deltas")
    study_folder.fill(folder)
    motions = read_motions(folder)
    train(experts_jobs(SMALL, motions)[0], motions, SMALL, folder, DECLARED)
    shared = ["--motions", str(folder), "--robots", str(folder / "robots"), "--small"]
    options = rounds.parse(["run", str(folder / base_of(0)), *shared, "--out", str(folder / "rounds")])
    rounds.begin(options, SMALL, SMALL_CONFIG, motions)
    place = Place("declared", rounds.BASE, 1)
    work = argparse.Namespace(
        place=place.name, motions=folder, robots=folder / "robots", out=folder / "rounds", shard=0, seconds=None
    )
    round_work.DO["record"](round_work.Work(work, SMALL, SMALL_CONFIG))
    return folder


@pytest.mark.slow
def test_every_step_runs_and_is_made_into_tables(folder: Path) -> None:
    out, motions = folder / "out", read_motions(folder)
    shared = ["--motions", str(folder), "--robots", str(folder / "robots"), "--small", "--out", str(out)]
    options = deltas.parse(["run", str(folder / "rounds"), "--robot", "declared", *shared])
    assert deltas.begin(options, SMALL, SMALL_DELTAS, motions) == ["c0", "c1"]
    for step in plan(out, motions.clusters, ()):
        kind, what = step.command[1:3]
        own = argparse.Namespace(
            what=what, rounds=folder / "rounds", motions=folder, robots=folder / "robots", out=out, seconds=None
        )
        delta_work.DO[kind](delta_work.Work(own, SMALL, SMALL_DELTAS))
        assert step.done.exists(), step.name
    cards = {what: out / f"delta-{what}" / "card.json" for what in (GENERAL, *motions.clusters)}
    counts = {what: json.loads(card.read_text())["rollouts"] for what, card in cards.items()}
    assert counts.pop(GENERAL) == sum(counts.values()) > max(counts.values())
    text = deltas_tables(out)
    assert text.count("| own |") == 9 and "| delta action | rollouts | left_ankle_pitch_joint |" in text
    errors = pd.read_csv(out / "errors-c0.csv")
    assert np.isfinite(errors["error"]).any() and set(errors["arm"]) == set(ARMS)
