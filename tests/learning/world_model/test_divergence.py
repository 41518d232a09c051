"""A training that leads nowhere, or cannot begin: one line, and the last good checkpoint stands."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.learning.learner import CHECKPOINT
from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.learning.world_model.trainer import WorldModelTrainer
from tests.learning.tiny import env_of
from tests.learning.world_model.test_resume import LEARNER
from tests.learning.world_model.test_trainer import TASK

EVERY = replace(LEARNER, checkpoint_every=1)


def started(folder: Path, config: WorldModelConfig = EVERY) -> tuple[WorldModelTrainer, bytes]:
    """A training after its first iteration, and its checkpoint."""
    made = WorldModelTrainer(env_of(TASK), config, folder)
    made.train(enough=lambda: made.iteration == 1)
    return made, (folder / CHECKPOINT).read_bytes()


def test_a_model_that_explodes_stops_the_training_and_a_lower_rate_goes_on_from_the_last_good_checkpoint(
    tmp_path: Path,
) -> None:
    _, good = started(tmp_path)
    wild = WorldModelTrainer(env_of(TASK), replace(EVERY, model_rate=1.0), tmp_path)
    stands = r"came .* at iteration \d\. The checkpoint of 1 stands\. Lower `model_rate`"
    with pytest.raises(BadInput, match=f"expected a model that predicts better than uniform motion, {stands}"):
        wild.train()
    assert (tmp_path / CHECKPOINT).read_bytes() == good
    again = WorldModelTrainer(env_of(TASK), EVERY, tmp_path)
    again.train()
    assert again.iteration == EVERY.iterations


def test_gradients_that_are_no_numbers_stop_it_before_weights_of_theirs_are_kept(tmp_path: Path) -> None:
    trained, good = started(tmp_path, replace(EVERY, policy_updates=1))
    gradient = trained.policy_update.descents["value"].differentiate
    trained.policy_update.descents["value"].differentiate = lambda loss: gradient(loss * float("nan"))  # type: ignore
    with pytest.raises(BadInput, match=r"gradient_value nan, at iteration 1.*Lower `value_rate`"):
        trained.train()
    assert (tmp_path / CHECKPOINT).read_bytes() == good


def test_what_is_no_number_is_named_before_a_network_learns_from_it(tmp_path: Path) -> None:
    trained, _ = started(tmp_path)
    mean = trained.policy_update.actor.obs_normalizer.mean
    step = trained.env.step

    def broken(action: torch.Tensor) -> tuple:
        outcome = step(action)
        trained.env.now[0].joint_vel[5, 2] = float("nan")
        return outcome

    trained.env.step = broken  # type: ignore[method-assign]
    with pytest.raises(BadInput, match=r"expected numbers, came nan in world 5, velocity of joint 2 \(clip \d"):
        trained.train()
    assert torch.equal(trained.policy_update.actor.obs_normalizer.mean, mean)


@pytest.mark.parametrize("name", ["window", "horizon"])
def test_windows_and_rollouts_longer_than_any_episode_are_refused_before_training(name: str, tmp_path: Path) -> None:
    wide = replace(EVERY, memory=100, **{name: 70})
    with pytest.raises(BadInput, match=f"{name}: expected at most 69 control steps, the longest episode, came 70"):
        WorldModelTrainer(env_of(TASK), wide, tmp_path)
    WorldModelTrainer(env_of(TASK), replace(wide, **{name: 69}), tmp_path)


def test_a_world_must_be_left_to_learn_from_beside_the_one_that_is_held_out(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"env.num_worlds: expected at least 2 .*came 1"):
        WorldModelTrainer(env_of(replace(TASK, num_worlds=1)), EVERY, tmp_path)
    WorldModelTrainer(env_of(replace(TASK, num_worlds=2)), EVERY, tmp_path)
