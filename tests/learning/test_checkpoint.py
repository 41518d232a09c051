"""Checkpoints hold tensors and plain values: they come back exactly, and a file with code in it is refused unread."""

import os
import pickle
from pathlib import Path

import mujoco
import numpy as np
import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.learning.checkpoint import load_checkpoint, save_checkpoint
from bumblebee.learning.learner import CHECKPOINT
from tests.learning.ppo.test_ppo import model, trainer  # noqa: F401


class Hostile:
    """Runs a command where it is unpickled."""

    def __init__(self, command: str) -> None:
        self.command = command

    def __reduce__(self) -> tuple:
        return os.system, (self.command,)


def test_tensors_arrays_and_plain_values_come_back_as_they_went(tmp_path: Path) -> None:
    content = {
        "state": np.arange(6.0).reshape(2, 3),
        "flags": np.array([True, False]),
        "nested": [{"t": torch.arange(3), "n": np.float64(0.1)}, (1, "x", None)],
        3: 0.5,
    }
    save_checkpoint(tmp_path / "c.pt", content)
    back = load_checkpoint(tmp_path / "c.pt")
    assert isinstance(back["state"], np.ndarray) and back["state"].dtype == np.float64
    assert np.array_equal(back["state"], content["state"]) and np.array_equal(back["flags"], content["flags"])
    assert torch.equal(back["nested"][0]["t"], torch.arange(3)) and back["nested"][0]["n"] == 0.1
    assert back["nested"][1] == (1, "x", None) and back[3] == 0.5


@pytest.mark.parametrize("write", [torch.save, lambda value, path: path.write_bytes(pickle.dumps(value))])
def test_a_checkpoint_that_carries_code_is_refused_in_one_line_and_nothing_of_it_runs(
    tmp_path: Path,
    model: mujoco.MjModel,  # noqa: F811
    write,
) -> None:
    mark = tmp_path / "mark"
    write({"algorithm": Hostile(f"touch {mark}"), "iteration": 1}, tmp_path / CHECKPOINT)
    with pytest.raises(BadInput, match="Remove it to train from the start") as refused:
        trainer(model, tmp_path)
    assert "\n" not in str(refused.value) and CHECKPOINT in str(refused.value)
    assert not mark.exists()


@pytest.mark.parametrize("damage", [b"", b"no checkpoint", None])
def test_a_broken_checkpoint_is_refused_in_one_line(tmp_path: Path, damage: bytes | None) -> None:
    path = tmp_path / CHECKPOINT
    save_checkpoint(path, {"state": np.zeros(1000)})
    path.write_bytes(path.read_bytes()[:700] if damage is None else damage)
    with pytest.raises(BadInput, match="a checkpoint of tensors"):
        load_checkpoint(path)
