"""Runs of other learners and seeds beside each other."""

from pathlib import Path

import pandas as pd
import pytest

from benchmarks.method import __main__ as command
from benchmarks.method.places import BASE
from benchmarks.method.settings import chosen
from benchmarks.study.motions import read_motions
from benchmarks.study.settings import freeze
from bumblebee.errors import BadInput
from tests.benchmarks.study import study_folder


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    study_folder.fill(tmp_path)
    return tmp_path


def tried(folder: Path, settings: str, seed: int, successes: list[bool]) -> Path:
    """A run whose base policy follows these of six motions, on the declared robot."""
    motions, method = read_motions(folder), chosen(settings, seed)
    out = folder / f"{settings}-{seed}"
    freeze(out, method, settings=settings, motions=motions.hash)
    rows = motions.labels[["name", "split"]].assign(robot="declared", mpjpe_rad=0.1, mpkpe_mm=50.0, mpkpe_local_mm=40.0)
    rows = rows.assign(success=successes, success_local=successes, success_upright=successes)
    for shard in range(method.shards):
        (out / BASE).mkdir(exist_ok=True)
        rows.iloc[shard :: method.shards].to_csv(out / BASE / f"tried-{shard}.csv", index=False)
    return out


def test_seeds_stand_beside_each_other_and_learners_are_paired_by_seed_and_motion(folder: Path) -> None:
    half = [True, False, True, False, True, False]
    runs = [tried(folder, "world_model", 0, half), tried(folder, "world_model", 1, [True] * 6)]
    runs.append(tried(folder, "ppo", 0, [False] * 6))
    out = folder / "beside.md"
    command.write_beside(command.parse(["beside", *map(str, runs), "--motions", str(folder), "--out", str(out)]))
    lines = out.read_text().splitlines()
    assert "| base policy, through a model | trained | 0.50 | 1.00 |" in lines
    assert "| base policy, PPO | trained | 0.00 |  |" in lines
    (pair,) = [line for line in lines if line.startswith("| base policy, PPO less base policy, through a model | tra")]
    assert "| 1 | -0.500 [" in pair  # of seed 0, which both have


def test_a_run_of_other_motions_or_without_trials_is_one_line(
    folder: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    run = tried(folder, "ppo", 0, [True] * 6)
    other = tmp_path_factory.mktemp("other")
    study_folder.fill(other)
    labels = pd.read_csv(other / "labels.csv")
    labels.assign(cluster="c0").to_csv(other / "labels.csv", index=False)
    given = ["beside", str(run), "--out", str(folder / "t.md"), "--motions"]
    with pytest.raises(BadInput, match="others: motions"):
        command.write_beside(command.parse([*given, str(other)]))
    for file in run.rglob("tried-*.csv"):
        file.unlink()
    with pytest.raises(BadInput, match="trials of the base policy, came none"):
        command.write_beside(command.parse([*given, str(folder)]))
    assert not (folder / "t.md").exists()


def test_one_run_twice_and_the_run_of_another_benchmark_are_one_line(folder: Path) -> None:
    run = tried(folder, "ppo", 0, [True] * 6)
    given = ["--motions", str(folder), "--out", str(folder / "t.md")]
    with pytest.raises(BadInput, match="runs: expected runs of different settings or seeds"):
        command.write_beside(command.parse(["beside", str(run), str(run), *given]))
    freeze(folder / "study", chosen("ppo", 0), motions="m")
    with pytest.raises(BadInput, match=r"a run of `benchmarks\.method`"):
        command.write_beside(command.parse(["beside", str(folder / "study"), *given]))
    assert not (folder / "t.md").exists()
