"""Training through a model on two waving clips, tiny and on a CPU."""

from pathlib import Path

import pytest
import torch

from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.learning.world_model.trainer import WorldModelTrainer
from bumblebee.tracking.config import EnvConfig
from tests.learning.tiny import env_of

TASK = EnvConfig(num_worlds=8, threads=1)
SMALL = WorldModelConfig(
    iterations=3,
    memory=16,
    window=4,
    horizon=4,
    model_batch=32,
    policy_batch=32,
    model_hidden=(32,),
    hidden=(32,),
    value_hidden=(32,),
    warm_up=5,
    checkpoint_every=3,
)


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> WorldModelTrainer:
    made = WorldModelTrainer(env_of(TASK), SMALL, tmp_path_factory.mktemp("run"))
    made.train()
    return made


def weights(trainer: WorldModelTrainer) -> dict[str, torch.Tensor]:
    saved = {"model": trainer.model_update.state_dict(), "policy": trainer.policy_update.state_dict()}
    found: dict[str, torch.Tensor] = {}

    def walk(name: str, value: object) -> None:
        if isinstance(value, dict):
            for key, part in value.items():
                walk(f"{name}.{key}", part)
        elif isinstance(value, torch.Tensor):
            found[name] = value

    walk("", saved)
    return found


def test_a_resumed_training_goes_on_with_equal_networks(trained: WorldModelTrainer, tmp_path: Path) -> None:
    again = WorldModelTrainer(env_of(TASK, seed=1), SMALL, trained.folder, seed=1)
    assert again.iteration == SMALL.iterations
    kept, found = weights(trained), weights(again)
    assert kept.keys() == found.keys() and any("critic" in name for name in kept)
    for name, value in kept.items():
        torch.testing.assert_close(found[name], value, rtol=0, atol=0, msg=name)


def test_policy_and_value_and_model_learn(trained: WorldModelTrainer) -> None:
    fresh = WorldModelTrainer(env_of(TASK), SMALL, trained.folder / "fresh")
    before, after = weights(fresh), weights(trained)
    for part in (".policy.actor.mlp", ".policy.average.mlp", ".policy.critic.network", ".policy.critic.average"):
        assert any(not torch.equal(before[name], after[name]) for name in before if name.startswith(part)), part
    assert any(not torch.equal(before[name], after[name]) for name in before if name.startswith(".model.model.layers"))
