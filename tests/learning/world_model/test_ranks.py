"""Several processes learn one model and one policy, each from worlds of its own."""

from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import torch

from bumblebee.learning.learner import CURVE
from bumblebee.learning.ranks import Ranks, launch
from bumblebee.learning.world_model.descent import Descent, Learning
from tests.learning.world_model.test_trainer import SMALL, TASK
from tests.learning.world_model.two_ranks import CONFIG

PROCESS = ["-m", "tests.learning.world_model.two_ranks"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where two processes trained to the end, and went on again from the checkpoint of iteration 2."""
    made = tmp_path_factory.mktemp("whole")
    assert launch(2, [*PROCESS, str(made)]) == 0
    return made


def learned(folder: Path) -> list[list[dict[str, Any]]]:
    """By process, the end of the unbroken training and of the one that went on."""
    return [torch.load(folder / f"{rank}.pt", weights_only=True) for rank in (0, 1)]


def test_both_learn_one_model_and_one_policy_from_worlds_of_their_own(folder: Path) -> None:
    """Networks, optimisers, normalisation and the clips' failures are equal to the bit; what was seen is not."""
    (first, _), (second, _) = learned(folder)
    assert first["weights"].keys() == second["weights"].keys()
    for name, value in first["weights"].items():
        assert torch.equal(value, second["weights"][name]), name
    assert torch.equal(first["failure"], second["failure"])
    assert (first["bodies"] != second["bodies"]).any(-1).all()
    frames = 2 * TASK.num_worlds * (SMALL.memory + SMALL.steps * (CONFIG.iterations - 1))
    assert first["frames"] == second["frames"] == frames == pd.read_csv(folder / CURVE)["frames"].iloc[-1]


def test_they_go_on_exactly_where_their_checkpoint_was(folder: Path) -> None:
    for whole, again in learned(folder):
        assert (whole["began"], again["began"]) == (0, 2) and torch.equal(whole["bodies"], again["bodies"])
        for name, value in whole["weights"].items():
            assert torch.equal(again["weights"][name], value), name


def test_gradients_are_averaged_before_they_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the other rank's gradient (1, 2) beside an own one of (3, 0), the mean's norm is sqrt 5."""
    weight = torch.nn.Parameter(torch.zeros(2))
    descent, ranks = Descent([weight], 0.1, 1.0), Ranks(0, 2)
    monkeypatch.setattr(Ranks, "add", lambda self, values: values.add_(torch.tensor([1.0, 2.0])))
    Learning(lambda: descent.differentiate(3 * weight[0]), descent.step, [descent], ranks)()
    torch.testing.assert_close(descent.steepness, torch.tensor(5.0).sqrt())
    torch.testing.assert_close(weight.grad, torch.tensor([2.0, 1.0]) / 5**0.5, rtol=1e-4, atol=0)
