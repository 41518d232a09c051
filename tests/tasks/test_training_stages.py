"""base and experts on a tiny library: what they write, and which clips an expert sees."""

import json
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
import torch
import yaml

from bumblebee.errors import BadInput
from bumblebee.learning import pretrained
from bumblebee.learning.policy import load_policy
from bumblebee.motion.store import write_library
from bumblebee.tracking.sampler import ClipSampler
from tasks import base, experts, training
from tasks.candidates import came_along
from tests.tracking.clips import waving

TINY = {
    "env": {"num_worlds": 4, "threads": 1},
    "ppo": {"iterations": 2, "steps": 2, "hidden": [8], "epochs": 1, "mini_batches": 1},
}


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Four clips in two clusters, one held out, and the parameters."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(training, "log_run", lambda *args, **kwargs: None)
    clips = [waving(name, 20 + 10 * i) for i, name in enumerate("abcd")]
    clips[3] = replace(clips[3], split="test")
    write_library(Path("data/filtered"), clips, None)
    Path("data/clusters").mkdir(parents=True)
    labels = {"name": list("abcd"), "cluster": ["c0", "c1", "c0", "c1"]}
    pd.DataFrame(labels).to_parquet("data/clusters/labels.parquet")
    Path("params.yaml").write_text(
        yaml.safe_dump({"clusters": ["c0", "c1"], "base": TINY | {"init": "scratch"}, "experts": TINY})
    )
    return tmp_path


def test_base_then_expert(workspace: Path) -> None:
    """Both folders are complete; the card says what was tried; the held-out clip was not trained on."""
    base.main()
    experts.main("c1")
    for folder in ("models/base", "models/experts/r0/c1"):
        names = {path.name for path in Path(folder).iterdir()}
        assert {"policy.pt", "policy.onnx", "contract.json", "curve.csv", "card.json"} <= names
    card = json.loads(Path("models/base/card.json").read_text())
    assert card["training_clips"] == ["a", "b", "c"]
    assert set(card["before"]) == set(card["after"]) == {"stand", "all"}
    assert card["frames"] == 2 * 2 * 4
    expert = json.loads(Path("models/experts/r0/c1/card.json").read_text())
    assert expert["parent"] == "models/base"
    trials = pd.read_csv("models/experts/r0/c1/trials.csv")
    assert set(trials["name"]) == {"b", "d"}


def test_an_expert_gives_the_others_their_share(workspace: Path) -> None:
    """A tenth of the draws goes to the other cluster, though it alone fails; with 0 none of its clips is used."""
    used, share, tried = training.cluster_clips("c0", others=0.1)
    sampler = ClipSampler(torch.tensor([clip.frames for clip in used]), shares=share)
    sampler.failure[:] = torch.tensor([float(clip.name == "b") for clip in used])
    chance = dict(zip((clip.name for clip in used), sampler.probabilities().tolist(), strict=True))
    assert chance["b"] == pytest.approx(0.1)
    assert {clip.name for clip in tried} == {"a", "c"}
    assert {clip.name for clip in training.cluster_clips("c0", others=0.0)[0]} == {"a", "c"}


def test_a_cluster_without_motions_is_bad_input(workspace: Path) -> None:
    """One line names the cluster."""
    with pytest.raises(BadInput, match="c7"):
        training.cluster_clips("c7", 0.1)


@pytest.mark.parametrize(("init", "parent"), [("pretrained", "pretrained"), ("randomised", "pretrained-randomised")])
def test_base_goes_on_from_a_policy_that_comes_with_the_code(workspace: Path, init: str, parent: str) -> None:
    """Its layers are the shipped policy's, whatever the section says; the card names the parent without its place."""
    content = yaml.safe_load(Path("params.yaml").read_text())
    content["base"]["init"] = init
    Path("params.yaml").write_text(yaml.safe_dump(content))
    base.main()
    card = json.loads(Path("models/base/card.json").read_text())
    assert card["parent"] == parent and came_along(Path("models/base"))
    assert load_policy(Path("models/base")).shape.hidden == load_policy(pretrained.FOLDER).shape.hidden


def test_a_parent_that_looks_elsewhere_is_bad_input(workspace: Path) -> None:
    """Another look-ahead is another observation: one line says so before training starts."""
    content = yaml.safe_load(Path("params.yaml").read_text())
    content["base"] |= {"init": "pretrained", "env": TINY["env"] | {"ahead": [0.2]}}
    Path("params.yaml").write_text(yaml.safe_dump(content))
    with pytest.raises(BadInput, match="ahead: expected"):
        base.main()
    assert not Path("models/base").exists()


@pytest.mark.parametrize(
    ("engine", "words"), [("mujoco", "1, or the engine `mujoco_warp`"), ("mujoco_warp", "99 NVIDIA GPUs")]
)
def test_more_gpus_than_there_are_is_bad_input(workspace: Path, engine: str, words: str) -> None:
    """Before any of the processes is started: the CPU engine has no use for them, and nobody has 99."""
    tiny = TINY | {"env": TINY["env"] | {"engine": engine}, "gpus": 99, "init": "scratch"}
    Path("params.yaml").write_text(yaml.safe_dump({"clusters": ["c0", "c1"], "base": tiny}))
    with pytest.raises(BadInput, match=words):
        base.main()
    assert not Path("models/base").exists()
