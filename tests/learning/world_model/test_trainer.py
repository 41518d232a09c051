"""Training through a model on two waving clips, tiny and on a CPU."""

from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from rsl_rl.models import MLPModel

from bumblebee.learning.config import PpoConfig
from bumblebee.learning.ppo.learner import Trainer
from bumblebee.learning.world_model.collector import Collector
from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.learning.world_model.dynamics import Dynamics
from bumblebee.learning.world_model.memory import Memory
from bumblebee.learning.world_model.model_update import ModelUpdate
from bumblebee.learning.world_model.trainer import WorldModelTrainer
from bumblebee.tracking.config import EnvConfig, Randomisation
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


def test_the_policies_are_normalised_by_all_that_was_seen_in_tensors_that_stay(trained: WorldModelTrainer) -> None:
    update = trained.policy_update
    own, kept = (network.obs_normalizer for network in (update.actor, update.average))
    looks = SMALL.memory - SMALL.steps + SMALL.iterations  # while the memory fills, then once an iteration
    assert own.count == looks * TASK.num_worlds
    places = {name: value.data_ptr() for name, value in own.state_dict().items()}
    mean = own.mean
    known = trained.shape.critic_observation
    update.look(torch.full((4, update.actor.obs_dim), 9.0), torch.full((4, known), 9.0))
    assert places == {name: value.data_ptr() for name, value in own.state_dict().items()}
    assert not torch.equal(own.mean, mean)
    assert torch.equal(own.mean, kept.mean) and torch.equal(own.std, kept.std)


def test_the_model_is_normalised_by_its_own_first_steps_whoever_the_policys_parent_is(
    trained: WorldModelTrainer, tmp_path: Path
) -> None:
    trained.policy().save(tmp_path)
    child = WorldModelTrainer(env_of(TASK), replace(SMALL, iterations=1), tmp_path / "child", parent=tmp_path)
    assert torch.equal(weights(child)[".policy.actor.mlp.0.weight"], weights(trained)[".policy.average.mlp.0.weight"])
    child.train()
    assert (child.model_update.model.scale != 1).all()


def test_ppo_goes_on_from_a_world_models_policy_and_it_from_ppos(trained: WorldModelTrainer, tmp_path: Path) -> None:
    """Exploration and value are the parent's, each in the child's own units."""
    trained.policy().save(tmp_path)
    ppo = Trainer(env_of(TASK), PpoConfig(iterations=1, steps=4), tmp_path / "ppo", parent=tmp_path)
    assert (ppo.algorithm.actor.state_dict()["distribution.std_param"] == SMALL.noise).all()
    seen = ppo.env.get_observations()
    own, factor = trained.policy_update.critic, 0.02 / (1 - SMALL.gamma)
    value = own.steady(own.normalised(seen["critic"][:, : trained.imagination.value_size]))
    torch.testing.assert_close(ppo.algorithm.critic(seen)[:, 0], factor * value)
    ppo.train()
    (tmp_path / "grown").mkdir()
    ppo.policy().save(tmp_path / "grown")
    child = WorldModelTrainer(env_of(TASK), SMALL, tmp_path / "child", parent=tmp_path / "grown")
    layers = child.policy_update.critic.network.state_dict()
    torch.testing.assert_close(factor * layers["2.bias"], ppo.algorithm.critic.state_dict()["mlp.2.bias"])
    child.train()


def test_resets_do_not_count_when_the_model_is_normalised() -> None:
    memory = Memory(4, torch.zeros(64, 0), 2)
    body = torch.zeros(64, 17)
    body[:, 3] = 1.0
    still = dict.fromkeys(("target", "before", "action", "earlier"), torch.zeros(64, 2))
    for step in range(4):
        moved = body + (0.001 * step + 5.0 * (step > 2)) * torch.eye(17)[0]  # put 5 m away after step 2
        memory.begin(torch.zeros(64).long(), torch.zeros(64).long(), body=moved, **still)
        memory.end(torch.full((64,), step == 2))
    update = ModelUpdate(Dynamics(2, (4,), 0.02), memory, replace(SMALL, window=2, warm_up=1))
    update.begin()
    torch.testing.assert_close(update.model.scale[0], torch.tensor(0.001), rtol=0.01, atol=0)


def test_policy_and_value_and_model_learn(trained: WorldModelTrainer) -> None:
    fresh = WorldModelTrainer(env_of(TASK), SMALL, trained.folder / "fresh")
    before, after = weights(fresh), weights(trained)
    for part in (".policy.actor.mlp", ".policy.average.mlp", ".policy.critic.network", ".policy.critic.average"):
        assert any(not torch.equal(before[name], after[name]) for name in before if name.startswith(part)), part
    assert any(not torch.equal(before[name], after[name]) for name in before if name.startswith(".model.model.layers"))


def test_training_lowers_the_models_held_out_error_and_raises_the_imagined_reward(tmp_path: Path) -> None:
    """From a policy that pushes every joint to one side; held out are steps of other worlds."""
    alike = Randomisation(friction=(1.0, 1.0), gains=0.0, mass=0.0, push=0.0)
    task = replace(TASK, num_worlds=32, threshold_end=0.8, observation_noise=0.0, randomisation=alike)
    sizes = {"model_hidden": (128, 128), "model_batch": 256, "model_updates": 40, "window": 2, "memory": 32}
    rates = {"policy_rate": 3e-3, "model_rate": 2e-3, "average": 0.8}
    trainer = WorldModelTrainer(
        env_of(task), replace(SMALL, iterations=12, checkpoint_every=100, **sizes, **rates), tmp_path
    )
    model, update = trainer.model_update.model, trainer.policy_update
    with torch.no_grad():
        update.actor.mlp[-1].bias.fill_(1.0)
    first, untrained = deepcopy(update.actor), deepcopy(model)
    trainer.train()
    other = env_of(task, seed=1)
    held_out = Memory(64, trainer.memory.context, other.num_actions)
    collect = Collector(other, held_out, 0.08)
    for _ in range(64):
        collect(lambda seen: update.actor({"policy": seen}))
    torch.manual_seed(0)
    window, starts = held_out.windows(2, 300), held_out.starts(300)
    first.obs_normalizer.load_state_dict(update.actor.obs_normalizer.state_dict())
    for name in ("mean", "std", "scale"):
        getattr(untrained, name).copy_(getattr(model, name))

    @torch.no_grad()
    def error(by: Dynamics) -> float:
        predicted = by.unrolled(window.bodies[0], window.targets, window.before, window.context)
        return float(by.loss(predicted, window.bodies[1:], window.valid))

    @torch.no_grad()
    def imagined(actor: MLPModel) -> float:
        rollout = trainer.imagination.rollout(lambda seen: actor({"policy": seen}), model, starts)
        return float(rollout.reward.mean())

    assert error(model) < 0.7 * error(untrained)
    assert imagined(first) + 0.2 < imagined(update.average)
