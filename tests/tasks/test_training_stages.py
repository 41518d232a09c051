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
from bumblebee.sim.sensors import load_model
from bumblebee.tracking.sampling.sampler import ClipSampler
from tasks import base, experts, refine, report
from tasks.policies import training
from tasks.policies.came_along import began, came_along, seen_before
from tasks.sections import Loop, Round
from tasks.settings import params
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


def test_without_a_learner_base_and_expert_are_the_shipped_policy_and_no_world_is_made(
    workspace: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Files that later stages read are there, the cards say that nothing was trained, and so do lines."""
    params = {"clusters": ["c0", "c1"], "base": {"learner": "none"}, "experts": {"learner": "none"}}
    Path("params.yaml").write_text(yaml.safe_dump(params))
    for name in ("make_engine", "try_policy"):
        monkeypatch.setattr(training, name, lambda *_, **__: pytest.fail("nothing is to be simulated"))
    base.main()
    experts.main("c1")
    shipped = load_policy(pretrained.FOLDER)
    for place, parent in (("base", "pretrained"), ("experts/r0/c1", "models/base")):
        folder = Path("models", place)
        assert {path.name for path in folder.iterdir()} == {"policy.pt", "policy.onnx", "contract.json", "card.json"}
        kept = load_policy(folder)
        for name, tensor in shipped.actor.state_dict().items():
            assert torch.equal(kept.actor.state_dict()[name], tensor)
        assert kept.critic_state.keys() == shipped.critic_state.keys(), "PPO refines it"
        card = json.loads((folder / "card.json").read_text())
        assert (card["kept"], card["frames"], card["parent"]) == ("parent", 0, parent) and "learner" not in card
    assert came_along(Path("models/base"))
    files = [Path("models", place, "policy.onnx").read_bytes() for place in ("base", "experts/r0/c1")]
    assert files[0] == files[1], "the evaluation runs equal files once"
    assert capsys.readouterr().out.count("no learner is set") == 2


MODEL = {
    "env": {"num_worlds": 4, "threads": 1},
    "learner": "world_model",
    "world_model": {"iterations": 2, "steps": 2, "memory": 6, "window": 3, "horizon": 3, "warm_up": 2}
    | {"model_updates": 1, "policy_updates": 1, "model_batch": 8, "policy_batch": 8}
    | {"hidden": [8], "model_hidden": [8]},
}


def test_a_world_model_trains_base_expert_and_refinement_and_no_later_stage_sees_a_difference(
    workspace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files, contract and columns are PPO's, which goes on from there too."""
    base.main()
    folders = ("models/base", "models/experts/r0/c1", "models/experts/r1/c1")
    files, contract = contents(Path(folders[0]))
    shape = {"clusters": ["c0", "c1"], "rounds": [{"n": 1, "parent": 0}], "base": MODEL | {"init": "scratch"}}

    def write(**sections: object) -> None:
        Path("params.yaml").write_text(yaml.safe_dump(shape | sections))

    write(experts=TINY)
    base.main()
    experts.main("c1")
    assert contents(Path(folders[1])) == (files, contract)
    write(experts=MODEL, refine=MODEL)
    experts.main("c1")
    world = training.World(load_model(physics_hz=100), threads=1)
    monkeypatch.setattr(refine, "learned", lambda *_: True)
    monkeypatch.setattr(refine, "corrected_world", lambda *_: world)
    monkeypatch.setattr(refine.paths, "corrected_model", lambda _: None)
    refine.main(1, "c1")
    for folder in map(Path, folders):
        names, stated = contents(folder)
        assert names == files and stated == contract
        card = json.loads((folder / "card.json").read_text())
        assert card["learner"] == "world_model" and "ppo" not in card["config"]
        assert card["iterations"] == 2 and card["frames"] == (6 + 2) * 4
        curve = pd.read_csv(folder / "curve.csv")
        assert {"iteration", "frames", "success", "key_error", "unstable", "loss_model", "alive"} <= set(curve)
    told = dict(report.learners(Loop(("c0", "c1"), (Round(1, 0),), 1)))
    assert told == dict.fromkeys(("base", "expert-c1 r0", "expert-c1 r1"), "world_model")


def contents(folder: Path) -> tuple[set[str], dict[str, object]]:
    """The names of a policy's files, and its contract but for the network's hash."""
    stated = json.loads((folder / "contract.json").read_text())
    return {path.name for path in folder.iterdir()}, stated | {"onnx_sha256": ""}


@pytest.mark.parametrize(
    ("env", "key", "fits"),
    [
        ({"episode_seconds": 0.1}, "world_model.horizon: expected at most 5", {"episode_seconds": 0.5}),
        ({"observation": {"history": 2}}, "env.observation.history: expected 1", {"observation": {"history": 1}}),
    ],
)
def test_a_task_that_a_world_model_cannot_take_is_bad_input(env: dict, key: str, fits: dict) -> None:
    section = MODEL | {"world_model": MODEL["world_model"] | {"horizon": 6}}
    with pytest.raises(BadInput, match=f"params.yaml: base.{key}"):
        params.build(base.BaseConfig, section | {"env": env}, "params.yaml", "base")
    params.build(base.BaseConfig, section | {"env": fits}, "params.yaml", "base")
    params.build(base.BaseConfig, section | {"env": env, "learner": "ppo"}, "params.yaml", "base")


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


def test_base_goes_on_from_ones_own_policy_and_cards_say_what_it_had_learnt_from(workspace: Path) -> None:
    """Another's policy under our name: the layers are its own, and the licences of its motions go on."""
    (new := Path("data/policy")).mkdir()
    load_policy(pretrained.RANDOMISED).save(new)
    (new / "card.json").write_text(json.dumps({"licences": {"MIT": 3}, "learnt_before": ["`first`: CC BY 4.0"]}))
    content = yaml.safe_load(Path("params.yaml").read_text())
    content["base"] |= {"init": "own", "learner": "none"}
    Path("params.yaml").write_text(yaml.safe_dump(content))
    base.main()
    assert began(Path("models/base")) == "own" and not came_along(Path("models/base"))
    assert seen_before(Path("models/base")) == ["`first`: CC BY 4.0", "`data/policy`: MIT (3)"]
    assert load_policy(Path("models/base")).shape == load_policy(pretrained.RANDOMISED).shape


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
