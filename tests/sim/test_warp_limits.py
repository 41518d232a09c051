"""Refusals of the GPU engine: contacts that do not fit, models, drivers, too little memory. One line each."""

import mujoco
import pytest
import torch

pytest.importorskip("mujoco_warp", reason="the extra `gpu` is not installed")

from bumblebee.errors import BadInput
from bumblebee.robot.model import build_spec
from bumblebee.sim.mujoco_warp import MujocoWarp
from bumblebee.sim.sensors import add_foot_sensors, load_model
from bumblebee.sim.warp_limits import Buffers, bytes_of, fitting, warp_modules, within_memory
from tests.sim.test_mujoco_warp import GPU, HAS_GPU, WORLDS, targets


@pytest.fixture(scope="module", params=["cpu", GPU])
def device(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return load_model()


def test_dropped_contacts_are_noticed(model: mujoco.MjModel, device: str) -> None:
    """Buffers that a standing robot overflows: one line names the limit and how to raise it."""
    for buffers, name in ((Buffers(contacts=1), "contacts"), (Buffers(constraints=8), "constraints")):
        engine = MujocoWarp(model, WORLDS, device=device, buffers=buffers)
        for step in range(10):
            engine.step(targets(step, device))
        with pytest.raises(BadInput, match=rf"{name}.*Raise `env.buffers.{name}`"):
            engine.check()


def test_a_model_that_warp_does_not_know_is_one_line(device: str) -> None:
    """The discrete integrator with the solver against slip is no feature of MuJoCo Warp."""
    spec = build_spec()
    add_foot_sensors(spec)
    spec.option.integrator, spec.option.noslip_iterations = mujoco.mjtIntegrator.mjINT_DISCRETE, 3
    with pytest.raises(BadInput, match="features that MuJoCo Warp supports"):
        MujocoWarp(spec.compile(), WORLDS, device=device)


@pytest.mark.skipif(HAS_GPU, reason="there is a GPU")
def test_without_a_gpu_one_line_says_so(model: mujoco.MjModel) -> None:
    """Before anything is allocated, with what to do."""
    with pytest.raises(BadInput, match=r"an NVIDIA GPU.*Use the engine `mujoco`"):
        MujocoWarp(model, WORLDS)


def test_a_driver_that_cannot_record_graphs_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """It names the driver's CUDA, the one that is wanted, and what to do; a Warp that sees no GPU is another line."""
    import warp

    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    monkeypatch.setattr(warp, "is_cuda_available", lambda: True)
    monkeypatch.setattr(warp, "is_conditional_graph_supported", lambda: False)
    monkeypatch.setattr(warp, "get_cuda_driver_version", lambda: (12, 2))
    with pytest.raises(BadInput, match=r"NVIDIA driver: expected CUDA 12.4 .* came CUDA 12.2. Update the driver."):
        warp_modules("cuda")
    monkeypatch.setattr(warp, "is_cuda_available", lambda: False)
    with pytest.raises(BadInput, match="none that warp can use"):
        warp_modules("cuda")


def test_worlds_are_counted_against_the_free_memory(model: mujoco.MjModel, monkeypatch: pytest.MonkeyPatch) -> None:
    """With 100 MiB free the line says how many worlds fit, and that many do fit."""
    monkeypatch.setattr(torch.cuda, "mem_get_info", lambda device: (100 * 2**20, 2**37))
    with pytest.raises(BadInput, match=r"num_worlds: .* At most \d+ fit") as refused:
        fitting(model, 10**6, Buffers(), "cuda")
    most = int(str(refused.value).split("At most ")[1].split()[0])
    assert bytes_of(fitting(model, most, Buffers(), "cuda")) <= 100 * 2**20
    assert most > 100


def test_memory_that_runs_out_beside_the_worlds_is_one_line() -> None:
    """Networks and batches need room too; other errors pass."""
    with pytest.raises(BadInput, match=r"num_worlds: .*8192 worlds: tried 3 GiB"), within_memory(8192):
        raise torch.OutOfMemoryError("tried 3 GiB\nmore")
    with pytest.raises(ZeroDivisionError), within_memory(8192):
        _ = 1 / 0


@pytest.mark.gpu
@pytest.mark.skipif(not HAS_GPU, reason="no NVIDIA GPU")
def test_too_many_worlds_for_the_memory_is_one_line(model: mujoco.MjModel) -> None:
    """The line names how many fit."""
    with pytest.raises(BadInput, match=r"At most \d+ fit"):
        MujocoWarp(model, 10_000_000)
