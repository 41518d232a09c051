"""The stage distill: the engine asked for, the clusters' shares, and experts of another task."""

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest
import torch
import yaml

from bumblebee.errors import BadInput
from bumblebee.learning.generalist.distill import DistillConfig
from bumblebee.learning.policy import Policy, Shape, load_policy, new_actor
from bumblebee.motion.store import write_library
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.sim.engine_choice import make_engine
from bumblebee.sim.warp_limits import Buffers
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.observing.observations import layout
from bumblebee.tracking.sampling.library import AHEAD
from tasks import distill
from tests.tracking.clips import waving

CLIPS, CLUSTER = [waving("a", 40), waving("b", 20), waving("c", 30)], [0, 1, 2]
TINY = {"num_worlds": 4, "threads": 1}


def test_the_engine_asked_for_is_made_and_the_motions_lie_on_its_device(monkeypatch: pytest.MonkeyPatch) -> None:
    """With its worlds, threads, effects and buffers, as the other trainings make theirs."""
    asked: list[tuple[Any, ...]] = []
    made: list[tuple[Any, ...]] = []

    def engine(name: str, model: object, *rest: object) -> SimpleNamespace:
        asked.append((name, *rest))
        return SimpleNamespace(device=torch.device("meta"))

    monkeypatch.setattr(distill, "make_engine", engine)
    monkeypatch.setattr(distill, "TrackingEnv", lambda *given, **named: made.append(given))
    buffers = Buffers(contacts=123)
    config = DistillConfig(env=EnvConfig(engine="mujoco_warp", buffers=buffers, num_worlds=8, threads=1))
    hooks = object()
    distill.environment(CLIPS, CLUSTER, 0, hooks, config)
    assert asked == [("mujoco_warp", 8, 1, hooks, buffers)]
    library, made_engine, task, seed = made[0]
    assert library.length.device == made_engine.device and task is config.env and seed == config.seed


@pytest.mark.parametrize("stretch", [0.0, 0.2])
def test_clusters_are_drawn_with_equal_shares_whatever_fails(stretch: float) -> None:
    """Failure rates of 0, 0 and 0.6 leave a third of the draws to each."""
    config = DistillConfig(env=EnvConfig(**TINY, sampler_stretch=stretch))
    sampler = distill.environment(CLIPS, CLUSTER, 0, None, config).sampler
    of_clip = sampler.clip if stretch else torch.arange(3)
    sampler.failure[:] = torch.tensor([0.0, 0.0, 0.6])[of_clip]
    drawn = torch.zeros(3).index_add(0, of_clip, sampler.probabilities())
    assert drawn.tolist() == pytest.approx([1 / 3] * 3)


def shape(**other: object) -> Shape:
    return Shape(**{"observation": 5, "critic_observation": 6, "actions": 23, "hidden": (8,), "ahead": AHEAD} | other)


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Base and two experts of round 0; `other` is what the second expert's shape has."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(distill, "make_engine", lambda *_: pytest.fail("it went on"))
    write_library(Path("data/filtered"), CLIPS, None)
    Path("data/clusters").mkdir(parents=True)
    labels = {"name": list("abc"), "cluster": ["c0", "c1", "c1"]}
    pd.DataFrame(labels).to_parquet("data/clusters/labels.parquet")

    def make(env: dict[str, object], distill: dict[str, object] | None = None, **other: object) -> None:
        loop = {"clusters": ["c0", "c1"], "rounds": [], "final_round": 0}
        Path("params.yaml").write_text(yaml.safe_dump({**loop, "distill": {"env": TINY | env, **(distill or {})}}))
        shapes = {"base": shape(), "experts/r0/c0": shape(), "experts/r0/c1": shape(**other)}
        for folder, own in shapes.items():
            Path("models", folder).mkdir(parents=True)
            Policy(new_actor(own), {}, own).save(Path("models", folder))

    return make


def test_an_expert_of_another_action_is_refused_in_a_line_that_names_it(workspace: Callable[..., None]) -> None:
    """Its answers mean something else; before anything is made."""
    workspace({}, action="default")
    with pytest.raises(BadInput) as refused:
        distill.main()
    line = str(refused.value)
    assert line.startswith("models/experts/r0/c1: action: expected 'reference' as in distill.env, came 'default'")
    assert "\n" not in line and not Path("models/generalist").exists()


@pytest.mark.parametrize(
    ("env", "words"),
    [({"action": "default"}, "models/base: action: expected 'default'"), ({"ahead": [0.5]}, "models/base: ahead")],
)
def test_a_task_that_is_not_the_experts_is_refused(
    workspace: Callable[..., None], env: dict[str, object], words: str
) -> None:
    """Whatever `distill.env` says, the experts were trained in theirs."""
    workspace(env)
    with pytest.raises(BadInput, match=words):
        distill.main()


def test_a_missing_expert_is_refused_in_a_line_that_names_it(workspace: Callable[..., None]) -> None:
    """Before anything is made."""
    workspace({})
    Path("models/experts/r0/c1/policy.pt").unlink()
    with pytest.raises(BadInput) as refused:
        distill.main()
    said = "models/experts/r0/c1/policy.pt: expected a trained policy, came no file."
    assert str(refused.value).startswith(said) and not Path("models/generalist").exists()


def test_the_stage_makes_a_transformer_that_the_runner_takes(
    workspace: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """From params.yaml to models/generalist: policy, contract with its memory, curve, card."""
    monkeypatch.setattr(distill, "make_engine", make_engine)
    monkeypatch.setattr(distill, "log_run", lambda *_, **__: None)
    student = {"student": {"terms": ["student"], "history": 10}}
    own = {"embedding": 12, "heads": 3, "memory": 4, "feed_forward": 8, "head": [16]}
    settings = {"model": "transformer", "init": "scratch", "transformer": own, "iterations": 2, "mini_batches": 2}
    size = sum(size for _, size in layout(23, len(AHEAD)))
    workspace(student, settings, observation=size)
    for folder in ("base", "experts/r0/c0"):
        seen = shape(observation=size)
        Policy(new_actor(seen), {}, seen).save(Path("models", folder))
    distill.main()
    made = Path("models/generalist")
    policy, trained = ExportedPolicy.load(made), load_policy(made)
    assert policy.memory == trained.shape.memory == (4, 13) and policy.seen.history == 10
    assert len(pd.read_csv(made / "curve.csv")) == 2
    card = json.loads((made / "card.json").read_text())
    assert card["config"]["transformer"]["embedding"] == 12 and set(card["agreement"]) >= {"all"}
    assert card["parameters"] == sum(tensor.numel() for tensor in trained.actor.parameters())
