"""A training that goes on from its checkpoint: to the bit what an unbroken one becomes, or with new episodes."""

from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.learning.checkpoint import load_checkpoint, save_checkpoint
from bumblebee.learning.learner import CHECKPOINT, CURVE
from bumblebee.learning.world_model.trainer import ERRORS, WorldModelTrainer
from tests.learning.tiny import env_of
from tests.learning.world_model.test_trainer import SMALL, TASK, weights

LEARNER = replace(SMALL, iterations=4, checkpoint_every=2, model_updates=2, policy_updates=2, hidden=(16,))


def trainer(folder: Path) -> WorldModelTrainer:
    return WorldModelTrainer(env_of(TASK), LEARNER, folder)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> WorldModelTrainer:
    made = trainer(tmp_path_factory.mktemp("whole"))
    made.train()
    return made


def test_a_training_killed_between_or_at_checkpoints_ends_with_the_same_networks_and_curves(
    whole: WorldModelTrainer, tmp_path: Path
) -> None:
    for killed_at in (3, 2):  # a checkpoint is of iteration 2
        folder = tmp_path / str(killed_at)
        first = trainer(folder)
        first.train(enough=lambda first=first, at=killed_at: first.iteration == at)
        torch.manual_seed(77)
        again = trainer(folder)
        assert again.iteration == 2
        again.train()
        assert again.frames == whole.frames
        kept, found = weights(whole), weights(again)
        assert kept.keys() == found.keys() and any("critic" in name for name in kept)
        for name, value in kept.items():
            assert torch.equal(found[name], value), name
        for name in (CURVE, ERRORS):
            curves = [pd.read_csv(at / name).drop(columns="seconds", errors="ignore") for at in (whole.folder, folder)]
            pd.testing.assert_frame_equal(*curves)
            assert len(curves[0]) > 1


def test_a_training_of_another_number_of_gpus_goes_on_with_new_episodes_and_says_so(
    whole: WorldModelTrainer, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    content = load_checkpoint(whole.folder / CHECKPOINT)
    save_checkpoint(tmp_path / CHECKPOINT, content | {"ranks": 2 * content["ranks"]})
    again = WorldModelTrainer(env_of(TASK), replace(LEARNER, iterations=5), tmp_path)
    assert "of 2 GPUs, goes on with 1 and new episodes" in capsys.readouterr().out
    for name, value in weights(whole).items():
        assert torch.equal(weights(again)[name], value), name
    again.train()
    assert again.iteration == 5 and again.frames == whole.frames + SMALL.memory * TASK.num_worlds
    assert all(torch.isfinite(value).all() for value in weights(again).values())


def test_a_checkpoint_of_other_networks_is_one_line(whole: WorldModelTrainer) -> None:
    with pytest.raises(BadInput, match=r"a checkpoint of these settings, came .*size mismatch.*Remove it"):
        WorldModelTrainer(env_of(TASK), replace(LEARNER, model_hidden=(8,)), whole.folder)
