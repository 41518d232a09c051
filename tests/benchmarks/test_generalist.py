"""The transformer against MLPs: as many parameters, cases run once, and cut off they go on."""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks import generalist
from benchmarks.generalist import ARMS, Case, equal_mlp, measured, read_done, run, settings_of, shipped
from bumblebee.learning.generalist.distill import DistillConfig
from bumblebee.learning.generalist.transformer import TransformerConfig
from bumblebee.learning.policy import Shape, new_actor
from tests.tracking.clips import waving

CASE = Case("transformer", 0, 2, 8, 4, 5e-4, 4000, "mujoco")
CLIPS = [waving(name, frames) for name, frames in (("a", 30), ("b", 40), ("c", 30), ("d", 40))]


def test_the_mlp_has_as_many_parameters_as_the_transformer() -> None:
    hidden, own = equal_mlp(DistillConfig()), TransformerConfig()
    shapes = Shape(1070, 1070, 23, hidden, ()), Shape(1070, 1070, 23, own.head, (), transformer=own)
    counts = [sum(tensor.numel() for tensor in new_actor(shape).parameters()) for shape in shapes]
    assert abs(counts[0] / counts[1] - 1) < 0.01


def test_all_arms_but_one_see_what_a_robot_senses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(generalist, "make_library", lambda: CLIPS)
    own = shipped()
    for arm in ARMS:
        config = settings_of(replace(CASE, arm=arm), own.task)
        assert config.env.observation == own.base.shape.seen
        assert (config.env.student.history, config.init) == ((1, "base") if arm == "seeing" else (10, "scratch"))
        assert (config.model == "transformer") == (arm == "transformer")


def test_the_shipped_policy_is_distilled_and_tried_and_one_cut_off_goes_on(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(generalist, "make_library", lambda: [replace(clip, split="train") for clip in CLIPS])
    cut = measured(CASE, tmp_path, 0.0)
    assert not cut["done"] and cut["frames"] == 32
    line = measured(CASE, tmp_path, 1e9)
    assert line["done"] and line["frames"] == 64 and len(line["curve"]) == 2
    assert line["clips"] == 4 and set(line["families"]) == {"stand", "all"} and set(line["after"]) == {"train"}


def test_a_case_that_the_file_has_is_not_run_again(tmp_path: Path) -> None:
    out = tmp_path / "out.jsonl"
    out.write_text(json.dumps({"case": vars(CASE)}) + "\n")
    assert read_done(out) == [vars(CASE)]
    own = {name: value for name, value in vars(CASE).items() if name not in ("arm", "seed")}
    options = argparse.Namespace(
        **own,
        **{"out": out, "workers": 1, "limit": None, "seeds": [0], "arms": ["transformer"], "seconds": 1.0},
        scratch=tmp_path / "scratch",
    )
    run(options)
    assert len(out.read_text().splitlines()) == 1 and not (tmp_path / "scratch").exists()
