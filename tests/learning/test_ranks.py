"""Training by several processes: one policy, worlds of their own, one curve, and going on after a death."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import psutil
import pytest
import torch

from bumblebee.errors import BadInput
from bumblebee.learning.learner import CHECKPOINT, CURVE
from bumblebee.learning.ranks import Ranks, join, launch
from tests.learning.two_ranks import CONFIG

PROCESS = ["-m", "tests.learning.two_ranks"]


def learned(folder: Path) -> list[dict[str, Any]]:
    return [torch.load(folder / f"{rank}.pt", weights_only=False) for rank in (0, 1)]


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Folders of two processes that trained to the end, and then once more until one of them died."""
    whole, broken = (tmp_path_factory.mktemp(name) for name in ("whole", "broken"))
    assert launch(2, [*PROCESS, str(whole), f"{broken}:2"]) == 7
    return whole, broken


@pytest.fixture(scope="module")
def whole(both: tuple[Path, Path]) -> Path:
    return both[0]


def test_both_processes_learn_one_policy_from_worlds_of_their_own(whole: Path) -> None:
    """Parameters, normalisation and learning rate are equal to the bit; worlds and episodes are not."""
    first, second = learned(whole)
    assert set(first["state"]) == set(second["state"]) and len(first["state"]) > 10
    for name, value in first["state"].items():
        assert torch.equal(value, second["state"][name]), name
    assert any("_mean" in name and bool(value.abs().sum() > 0) for name, value in first["state"].items())
    assert first["rate"] == second["rate"]
    assert not torch.equal(first["frame"], second["frame"])
    assert not np.allclose(first["mass"], second["mass"])


@pytest.mark.slow
def test_the_captured_update_learns_one_policy_too(whole: Path, tmp_path: Path) -> None:
    """Equal to the bit on both; and not by chance what rsl_rl's update learns, which draws other noise."""
    assert launch(2, [*PROCESS, f"{tmp_path}:captured"]) == 0
    first, second = learned(tmp_path)
    for name, value in first["state"].items():
        assert torch.equal(value, second["state"][name]), name
    assert first["rate"] == second["rate"] != CONFIG.learning_rate
    assert any(not torch.equal(value, learned(whole)[0]["state"][name]) for name, value in first["state"].items())


def test_the_normalisation_has_seen_the_frames_of_all(whole: Path) -> None:
    """Its count is the number of control steps of both processes, as is the curve's."""
    state = learned(whole)[0]["state"]
    counts = {int(value) for name, value in state.items() if name.endswith("count")}
    frames = 2 * 8 * CONFIG.steps * CONFIG.iterations
    assert counts == {frames}
    curve = pd.read_csv(whole / CURVE)
    assert curve["frames"].tolist() == [frames // 3, 2 * frames // 3, frames]


def test_it_goes_on_where_it_was_when_one_process_died(both: tuple[Path, Path]) -> None:
    """The other is ended, the checkpoint of iteration 2 is continued, and the end is that of an unbroken training."""
    whole, broken = both
    assert (broken / CHECKPOINT).exists() and not (broken / "0.pt").exists()
    assert launch(2, [*PROCESS, str(broken)]) == 0
    again, unbroken = learned(broken), learned(whole)
    assert [one["began"] for one in again] == [2, 2]
    for name, value in unbroken[0]["state"].items():
        assert torch.equal(value, again[0]["state"][name]), name
    for a, b in zip(again, unbroken, strict=True):
        assert torch.equal(a["frame"], b["frame"])
    curves = [pd.read_csv(folder / CURVE).drop(columns="seconds") for folder in (whole, broken)]
    pd.testing.assert_frame_equal(*curves)


SLEEPER = """
import os, sys, time
from bumblebee.learning.ranks import end_with_launcher
end_with_launcher()
with open(sys.argv[1] + os.environ["RANK"], "w") as file:
    file.write(str(os.getpid()))
time.sleep(100)
"""


def test_no_process_outlives_the_one_that_started_them(tmp_path: Path) -> None:
    """Killed without a chance to end them itself."""
    start = f"from bumblebee.learning.ranks import launch; launch(2, ['-c', {SLEEPER!r}, {str(tmp_path) + '/'!r}])"
    launcher = subprocess.Popen([sys.executable, "-c", start])
    files = [tmp_path / "0", tmp_path / "1"]
    _until(lambda: all(file.exists() and file.read_text() for file in files))
    launcher.send_signal(signal.SIGKILL)
    launcher.wait()
    _until(lambda: not any(_runs(int(file.read_text())) for file in files))


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
        return psutil.Process(process).status() != psutil.STATUS_ZOMBIE
    except (ProcessLookupError, psutil.NoSuchProcess):
        return False


def _until(true: Callable[[], bool]) -> None:
    for _ in range(1200):
        if true():
            return
        time.sleep(0.05)
    raise AssertionError("not within a minute")


def test_more_ranks_than_gpus_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first rank says how many there are; the others leave without a word."""
    monkeypatch.setenv("WORLD_SIZE", "65")
    monkeypatch.setenv("RANK", "0")
    with pytest.raises(BadInput, match=r"gpus: expected 65 NVIDIA GPUs.*came \d+ that torch can use"):
        join()
    monkeypatch.setenv("RANK", "64")
    with pytest.raises(SystemExit) as silent:
        join()
    assert silent.value.code == 2


def test_alone_nothing_is_asked_of_others() -> None:
    """One process decides, gathers and averages by itself."""
    alone = Ranks()
    assert alone.decide(lambda: True) and alone.gather(5) == [5]
    assert alone.mean({"a": 2.0}, "cpu") == {"a": 2.0} and alone.seed(4) == 4
