"""The stage distill: the engine asked for, the clusters' shares, and experts of another task."""

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest
import torch
import yaml

from bumblebee.errors import BadInput
from bumblebee.learning.distill import DistillConfig
from bumblebee.learning.policy import Policy, Shape, new_actor
from bumblebee.motion.store import write_library
from bumblebee.sim.warp_limits import Buffers
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.library import AHEAD
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

    def make(env: dict[str, object], **other: object) -> None:
        loop = {"clusters": ["c0", "c1"], "rounds": [], "final_round": 0}
        Path("params.yaml").write_text(yaml.safe_dump({**loop, "distill": {"env": TINY | env}}))
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
