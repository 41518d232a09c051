"""The transformer against MLPs: as many parameters, the study's experts, cases run once, and cut off they go on."""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from benchmarks import generalist
from benchmarks.generalist import ARMS, Case, Given, equal_mlp, measured, read_done, run, settings_of, shipped
from benchmarks.motion_pack import Packed, write_pack
from benchmarks.study.motions import LABELS, MOTIONS, read_motions
from benchmarks.study.settings import SMALL
from benchmarks.study.trying import try_policy
from bumblebee.errors import BadInput
from bumblebee.learning.distill import DistillConfig
from bumblebee.learning.policy import Policy, Shape, load_policy, new_actor, shape_of
from bumblebee.learning.transformer import TransformerConfig
from tests.learning.tiny import env_of
from tests.tracking.clips import waving

CASE = Case("transformer", 0, 2, 8, 4, 5e-4, 4000, "mujoco")
CLIPS = [waving(name, frames) for name, frames in (("a", 30), ("b", 40), ("c", 30), ("d", 40))]


@pytest.fixture
def given(tmp_path: Path) -> Given:
    """Two clusters of two motions, and a run with a base policy and two experts that were not trained."""
    (tmp_path / "motions").mkdir()
    rows = [Packed("made", True, replace(clip, split="train")) for clip in CLIPS]
    write_pack(tmp_path / "motions" / MOTIONS, rows)
    names = [clip.name for clip in CLIPS]
    facts = {"name": names, "motion": names, "group": "made", "family": "stand", "split": "train", "seconds": 0.6}
    pd.DataFrame(facts | {"cluster": ["c0", "c0", "c1", "c1"]}).to_csv(tmp_path / "motions" / LABELS, index=False)
    shape = shape_of(env_of(SMALL.env), (16,))
    for name in ("s0-base", "s0-c0", "s0-c1"):
        (tmp_path / "run" / name).mkdir(parents=True)
        Policy(new_actor(shape), {}, shape).save(tmp_path / "run" / name)
    return Given(tmp_path / "run", tmp_path / "motions", tmp_path / "scratch", 1e9, small=True)


def test_the_mlp_has_as_many_parameters_as_the_transformer() -> None:
    hidden, own = equal_mlp(DistillConfig()), TransformerConfig()
    shapes = Shape(1070, 1070, 23, hidden, ()), Shape(1070, 1070, 23, own.head, (), transformer=own)
    counts = [sum(tensor.numel() for tensor in new_actor(shape).parameters()) for shape in shapes]
    assert abs(counts[0] / counts[1] - 1) < 0.01


def test_all_arms_but_one_see_what_a_robot_senses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(generalist, "make_library", lambda: CLIPS)
    own = shipped()
    for arm in ARMS:
        config = settings_of(replace(CASE, arm=arm), own)
        assert config.env.observation == own.base.shape.seen
        assert (config.env.student.history, config.init) == ((1, "base") if arm == "seeing" else (10, "scratch"))
        assert (config.model == "transformer") == (arm == "transformer")


@pytest.mark.parametrize("arm", ["transformer", "seeing"])
def test_a_run_of_the_study_is_distilled_and_one_cut_off_goes_on(given: Given, arm: str) -> None:
    """The policy lies in the run, where the study's own trials find it."""
    case = replace(CASE, arm=arm)
    cut = measured(case, replace(given, seconds=0.0))
    assert not cut["done"] and cut["frames"] == 32
    line = measured(case, given)
    assert line["done"] and line["frames"] == 64 and len(line["curve"]) == 2
    made = given.run / f"s0-{arm}"
    assert line["policy"] == str(made) and (load_policy(made).shape.memory is None) == (arm == "seeing")
    assert len(try_policy(made, read_motions(given.motions))) == 8


def test_the_shipped_policy_is_distilled_and_tried(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(generalist, "make_library", lambda: [replace(clip, split="train") for clip in CLIPS])
    line = measured(CASE, Given(None, None, tmp_path, 1e9))
    assert line["clips"] == 4 and set(line["families"]) == {"stand", "all"} and set(line["after"]) == {"train"}


def test_a_case_that_the_file_has_is_not_run_again(tmp_path: Path) -> None:
    out = tmp_path / "out.jsonl"
    out.write_text(json.dumps({"case": vars(CASE)}) + "\n")
    assert read_done(out) == [vars(CASE)]
    own = {name: value for name, value in vars(CASE).items() if name not in ("arm", "seed")}
    options = argparse.Namespace(
        **own,
        **{"out": out, "workers": 1, "limit": None, "seeds": [0], "arms": ["transformer"], "seconds": 1.0},
        **{"run": None, "motions": None, "small": False, "scratch": tmp_path / "scratch"},
    )
    run(options)
    assert len(out.read_text().splitlines()) == 1 and not (tmp_path / "scratch").exists()


def test_an_expert_that_the_run_has_not_is_named(given: Given) -> None:
    (given.run / "s0-c1" / "policy.pt").unlink()
    with pytest.raises(BadInput, match=r"s0-c1/policy\.pt: expected a trained policy, came no file"):
        measured(CASE, given)


def test_a_run_without_its_motions_is_refused(given: Given) -> None:
    with pytest.raises(BadInput, match="--motions: expected the motions of the run"):
        measured(CASE, replace(given, motions=None))
