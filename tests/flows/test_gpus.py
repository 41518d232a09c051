"""Stages that run side by side get GPUs of their own, by what their environment says; no GPU is needed to see it."""

import os
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from bumblebee.errors import BadInput
from flows import gpus, loop

LISTING = """GPU 0: NVIDIA H100 80GB HBM3 (UUID: GPU-aaaa)
  MIG 1g.10gb     Device  0: (UUID: MIG-cccc)
GPU 1: NVIDIA H100 80GB HBM3 (UUID: GPU-bbbb)
"""


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Experts on a GPU, a refinement on two together, everything else on the CPU; four devices may be used."""
    (tmp_path / "dvc.yaml").write_text(
        "stages:\n"
        + "".join(f"  {name}: {{cmd: x, params: [{name}, clusters]}}\n" for name in ("experts", "refine", "delta"))
    )
    (tmp_path / "params.yaml").write_text(
        "clusters: [c0]\nexperts: {env: {engine: mujoco_warp}}\nrefine: {gpus: 2, env: {engine: mujoco_warp}}\n"
        "delta: {}\n"
    )
    monkeypatch.setenv(gpus.VARIABLE, "4, 5,6,7")
    return tmp_path


def seen(stack: ExitStack, workspace: Path, stage: str) -> str | None:
    """Devices that a stage which starts now and runs on is told to see."""
    return stack.enter_context(loop.devices_of(workspace, stage)).get(gpus.VARIABLE)


def test_stages_side_by_side_are_spread_over_all_devices_before_any_is_shared(workspace: Path):
    with ExitStack() as running:
        assert [seen(running, workspace, f"experts@c{n}") for n in range(6)] == ["4", "5", "6", "7", "4", "5"]
    with ExitStack() as running:
        assert seen(running, workspace, "experts@c0") == "4", "those that ended leave their devices"
        assert seen(running, workspace, "refine@after0-c0") == "5,6", "one that trains on two gets two"
        assert seen(running, workspace, "experts@c1") == "7"


def test_a_machine_without_a_gpu_is_refused_before_the_first_stage(workspace: Path, monkeypatch: pytest.MonkeyPatch):
    gpus.require(workspace, ["experts@c0"])
    monkeypatch.setenv(gpus.VARIABLE, "")
    monkeypatch.setattr(gpus, "_seen_by_torch", lambda: False)
    gpus.require(workspace, ["delta@after0-c0", "data/raw/mine.dvc"])
    with pytest.raises(BadInput, match=r"params.yaml: engine mujoco_warp: .* for the stage experts@c0, came none here"):
        gpus.require(workspace, ["refine@after0-c0", "experts@c0", "delta@after0-c0"])
    monkeypatch.setattr(gpus, "_seen_by_torch", lambda: True)
    gpus.require(workspace, ["experts@c0"])


def test_a_device_that_becomes_free_is_the_next_ones(workspace: Path):
    with ExitStack() as running:
        for n in (0, 1):
            seen(running, workspace, f"experts@c{n}")
        with ExitStack() as short:
            assert seen(short, workspace, "experts@c2") == "6"
        assert seen(running, workspace, "experts@c3") == "6"


def test_stages_on_the_cpu_and_sets_of_motions_are_left_alone(workspace: Path, monkeypatch: pytest.MonkeyPatch):
    with ExitStack() as running:
        assert seen(running, workspace, "delta@after0-c0") is None
        assert seen(running, workspace, "data/raw/mine.dvc") is None
        monkeypatch.setenv(gpus.VARIABLE, "")
        assert seen(running, workspace, "experts@c0") is None, "the stage itself says that there is none"


def test_a_stage_that_wants_more_than_there_are_sees_them_all(workspace: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv(gpus.VARIABLE, "3")
    with ExitStack() as running:
        assert seen(running, workspace, "refine@after0-c0") == "3"


def test_without_a_word_the_driver_says_which_there_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "nvidia-smi").write_text(f"#!{sys.executable}\nprint('''{LISTING}''')\n")
    (tmp_path / "nvidia-smi").chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.delenv(gpus.VARIABLE, raising=False)
    assert gpus.usable() == ["GPU-aaaa", "GPU-bbbb"]
    (tmp_path / "nvidia-smi").write_text("#!/bin/sh\nexit 9\n")
    assert gpus.usable() == []
    assert gpus.usable({gpus.VARIABLE: "-1"}) == []
