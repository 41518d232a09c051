"""The least memory of a GPU that a training needs, against the tensors that small trainers make."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from tensordict import TensorDict

from bumblebee.errors import BadInput
from bumblebee.learning.config import PpoConfig
from bumblebee.learning.gpu_memory import Needs, ppo_needs
from bumblebee.learning.learner import Learner
from bumblebee.learning.learners import Config, make_learner
from bumblebee.learning.ppo.learner import Trainer
from bumblebee.learning.world_model.gpu_memory import world_model_needs
from bumblebee.learning.world_model.trainer import WorldModelTrainer
from bumblebee.tracking.config import EnvConfig
from tests.learning.tiny import env_of
from tests.learning.world_model.test_trainer import SMALL

TASK = EnvConfig(num_worlds=4, threads=1)
PPO = PpoConfig(iterations=1, steps=4, epochs=1, mini_batches=2, hidden=(64, 32))
MODEL = replace(SMALL, iterations=1)


def size(tensors: Iterable[torch.Tensor]) -> int:
    """Bytes of different tensors."""
    return sum({t.untyped_storage().data_ptr(): t.untyped_storage().nbytes() for t in tensors}.values())


def needs_of(made: Learner) -> Needs:
    groups, joints, robots = made._groups(), made.env.num_actions, made.env.num_envs
    if isinstance(made, WorldModelTrainer):
        return world_model_needs(made.config, robots, groups, joints, 1, made.memory.context.shape[1])
    return ppo_needs(made.config, robots, groups, joints)


def test_the_memory_of_the_world_model_is_counted_to_the_byte(tmp_path: Path) -> None:
    made = make_learner(MODEL, env_of(TASK), tmp_path)
    assert isinstance(made, WorldModelTrainer)
    ring = [*made.memory.columns.values(), made.memory.clip, made.memory.frame, made.memory.broken]
    assert needs_of(made).kept["env.num_worlds"] == size(ring)


def test_the_steps_that_ppo_keeps_are_counted_to_the_byte(tmp_path: Path) -> None:
    made = make_learner(PPO, env_of(TASK), tmp_path)
    assert isinstance(made, Trainer)
    made.train()
    kept: list[torch.Tensor] = []
    for value in vars(made.algorithm.storage).values():
        parts = value if isinstance(value, tuple) else value.values() if isinstance(value, TensorDict) else [value]
        kept += [part for part in parts if isinstance(part, torch.Tensor)]
    every = needs_of(made).kept["env.num_worlds"]
    without = needs_of(made).kept["env.num_worlds"] - size(kept)
    seen = made._groups()
    held = 4 * 8 * (seen["policy"] + seen["critic"] + 4 * sum(PPO.hidden))
    assert without == held < every


def test_networks_are_counted_with_what_their_optimisers_keep(tmp_path: Path) -> None:
    made = make_learner(PPO, env_of(TASK), tmp_path)
    assert isinstance(made, Trainer)
    weights = [*made.algorithm.actor.mlp.parameters(), *made.algorithm.critic.mlp.parameters()]
    assert needs_of(made).kept["ppo.hidden"] == 4 * size(weights)
    other = make_learner(MODEL, env_of(TASK), tmp_path / "model")
    assert isinstance(other, WorldModelTrainer)
    assert needs_of(other).kept["world_model.model_hidden"] == 3 * size(other.model_update.model.parameters())


@pytest.mark.parametrize("which", ["policy", "model"])
def test_updates_of_the_world_model_hold_at_least_what_is_counted(tmp_path: Path, which: str) -> None:
    made = make_learner(MODEL, env_of(TASK), tmp_path)
    assert isinstance(made, WorldModelTrainer)
    made.train()
    saved: list[torch.Tensor] = []
    update = made.policy_update if which == "policy" else made.model_update

    def keep(tensor: torch.Tensor) -> torch.Tensor:
        saved.append(tensor)
        return tensor

    with torch.autograd.graph.saved_tensors_hooks(keep, lambda tensor: tensor):
        update._differentiate()
    assert 0 < needs_of(made).passing[f"world_model.{which}_batch"] <= size(saved)


def test_the_line_names_need_and_card_and_what_passes_counts_once() -> None:
    needs = Needs({"env.num_worlds": 2 * 10**9}, {"a": 10**9, "b": 3 * 10**9})
    assert needs.line(4096, 8 * 10**9, 10**10) == (
        "needs at least 5.0 GB of GPU memory at 4096 robots; the card has 8.0 of its 10.0 GB free"
    )


@pytest.mark.parametrize(
    ("config", "setting"),
    [(replace(PPO, steps=64), "env.num_worlds"), (replace(MODEL, policy_batch=4096), "world_model.policy_batch")],
)
def test_a_card_that_is_too_small_is_refused_in_one_line_whose_remedy_fits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, config: Config, setting: str
) -> None:
    made = make_learner(config, env_of(TASK), tmp_path)
    free = needs_of(made).least - 1
    made.env.device = "cuda"
    monkeypatch.setattr(torch.cuda, "mem_get_info", lambda device: (free, 2 * free))
    with pytest.raises(BadInput, match=f"free memory of the GPU: .*Lower `{setting}`") as caught:
        made._fit(needs_of(made))
    assert "\n" not in str(caught.value)
    if setting == "env.num_worlds":
        made._fit(ppo_needs(PPO, 2, made._groups(), made.env.num_actions))
    else:
        made.config = replace(made.config, policy_batch=32)
        made._fit(needs_of(made))


def test_what_torch_keeps_aside_from_earlier_trainings_counts_as_free(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    made = make_learner(PPO, env_of(TASK), tmp_path)
    made.env.device = "cuda"
    for name, value in {"mem_get_info": (0, 10**9), "memory_reserved": 6 * 10**8, "memory_allocated": 10**8}.items():
        monkeypatch.setattr(torch.cuda, name, lambda device, value=value: value)
    made._fit(needs_of(made))
    assert capsys.readouterr().out.endswith("at 4 robots; the card has 0.5 of its 1.0 GB free\n")
