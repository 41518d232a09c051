"""Both learners behind one interface: whose checkpoint is whose, and what each refuses before it trains."""

from dataclasses import replace
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from bumblebee.learning.config import PpoConfig
from bumblebee.learning.learner import CHECKPOINT
from bumblebee.learning.learners import Config, make_learner
from bumblebee.tracking.config import EnvConfig
from tests.learning.tiny import env_of
from tests.learning.world_model.test_trainer import SMALL
from tests.tracking.clips import waving

TASK = EnvConfig(num_worlds=2, threads=1)
PPO = PpoConfig(iterations=1, steps=2, epochs=1, mini_batches=1, hidden=(8,))
MODEL = replace(SMALL, hidden=(8,), window=2, horizon=2, memory=8)
OTHERS: dict[str, tuple[Config, EnvConfig]] = {
    "learner": (PPO, TASK),
    "observation": (MODEL, replace(TASK, ahead=(0.2,))),
    "hidden": (replace(MODEL, hidden=(9,)), TASK),
    "settings": (replace(MODEL, model_hidden=(9,)), TASK),
}


@pytest.mark.parametrize("named", OTHERS)
def test_a_checkpoint_of_another_learner_or_task_is_refused_and_can_be_removed(tmp_path: Path, named: str) -> None:
    make_learner(MODEL, env_of(TASK), tmp_path).save_checkpoint()
    config, task = OTHERS[named]
    with pytest.raises(BadInput, match=named) as caught:
        make_learner(config, env_of(task), tmp_path)
    assert "\n" not in str(caught.value) and "Remove it" in caught.value.do
    (tmp_path / CHECKPOINT).unlink()
    assert make_learner(config, env_of(task), tmp_path).iteration == 0


@pytest.mark.parametrize("config", [PPO, MODEL])
def test_a_learner_counts_the_frames_that_it_said_were_coming(tmp_path: Path, config: Config) -> None:
    made = make_learner(replace(config, iterations=2), env_of(TASK), tmp_path)
    coming = made._coming()
    made.train()
    assert made.frames == coming > 0 and made._coming() == 0


def test_a_window_longer_than_all_motions_is_refused_with_one_that_is_taken(tmp_path: Path) -> None:
    short = [waving("a", 7)]
    with pytest.raises(BadInput, match=r"world_model.window: expected at most 6 control steps"):
        make_learner(replace(MODEL, window=7, memory=9), env_of(TASK, short), tmp_path)
    make_learner(replace(MODEL, window=6), env_of(TASK, short), tmp_path)
