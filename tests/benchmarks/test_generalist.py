"""The transformer against the MLP: as many parameters, cases run once, and cut off they go on."""

import argparse
import json
from pathlib import Path

import pandas as pd
import pytest

from benchmarks.generalist import Case, Given, equal_mlp, measured, read_done, run, settings
from bumblebee.errors import BadInput
from bumblebee.learning import pretrained
from bumblebee.learning.distill import DistillConfig
from bumblebee.learning.policy import Shape, load_policy, new_actor
from bumblebee.learning.transformer import TransformerConfig
from bumblebee.motion.store import write_library
from tests.tracking.clips import waving

CASE = Case("transformer", 0, 2, 8, 4, 5e-4, "mujoco")


@pytest.fixture
def given(tmp_path: Path) -> Given:
    """Two clusters of one clip, the shipped policy for both."""
    write_library(tmp_path / "clips", [waving("a", 30), waving("b", 40)], None)
    pd.DataFrame({"name": ["a", "b"], "cluster": ["c0", "c1"]}).to_parquet(tmp_path / "labels.parquet")
    experts = tuple(f"{name}={pretrained.FOLDER}" for name in ("c0", "c1"))
    return Given(experts, tmp_path / "clips", tmp_path / "labels.parquet", tmp_path / "scratch", 1e9)


def test_the_mlp_has_as_many_parameters_as_the_transformer() -> None:
    hidden, own = equal_mlp(DistillConfig()), TransformerConfig()
    shapes = Shape(1070, 1070, 23, hidden, ()), Shape(1070, 1070, 23, own.head, (), transformer=own)
    counts = [sum(tensor.numel() for tensor in new_actor(shape).parameters()) for shape in shapes]
    assert abs(counts[0] / counts[1] - 1) < 0.01


def test_both_learn_in_the_experts_task_and_see_what_a_robot_senses() -> None:
    expert = load_policy(pretrained.FOLDER)
    for model in ("mlp", "transformer"):
        config = settings(Case(model, 0, 2, 8, 4, 5e-4, "mujoco"), expert)
        assert (config.model, config.init, config.env.student.history) == (model, "scratch", 10)
        assert config.env.observation == expert.shape.seen and config.env.ahead == expert.shape.ahead


def test_a_case_is_measured_and_one_cut_off_goes_on(given: Given) -> None:
    cut = measured(CASE, Given(given.experts, given.motions, given.labels, given.scratch, 0.0))
    assert not cut["done"] and cut["frames"] == 32
    line = measured(CASE, given)
    assert line["done"] and line["frames"] == 64 and len(line["curve"]) == 2
    assert line["clips"] == 2 and set(line["families"]) == {"stand", "all"}


def test_a_case_that_the_file_has_is_not_run_again(tmp_path: Path) -> None:
    out = tmp_path / "out.jsonl"
    out.write_text(json.dumps({"case": vars(CASE)}) + "\n")
    assert read_done(out) == [vars(CASE)]
    options = argparse.Namespace(
        **{"out": out, "workers": 1, "limit": None, "seeds": [0], "models": ["transformer"], "iterations": 2},
        **{"worlds": 8, "steps": 4, "rate": 5e-4, "engine": "mujoco", "minutes": 1.0, "experts": [], "motions": None},
        **{"labels": None, "scratch": tmp_path / "scratch"},
    )
    run(options)
    assert len(out.read_text().splitlines()) == 1 and not (tmp_path / "scratch").exists()


def test_experts_by_cluster_need_the_clusters(given: Given) -> None:
    with pytest.raises(BadInput, match="--labels"):
        measured(CASE, Given(given.experts, given.motions, None, given.scratch, 1.0))
