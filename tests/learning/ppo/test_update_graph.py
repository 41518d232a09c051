"""Recordings of the update: renewed when a tensor has moved, done without where they fail; a GPU's is the CPU's."""

import contextlib
from collections.abc import Callable
from dataclasses import replace

import pytest
import torch
from torch import Tensor

from bumblebee.learning.ppo.update_graph import Recorded, forget_recordings
from tests.learning.ppo.test_update import CONFIG, algorithm, learned, networks

GPU = pytest.mark.skipif(not torch.cuda.is_available(), reason="no NVIDIA GPU")


class Graph:
    """Recording without a GPU."""

    def __init__(self, work: Callable[[], None]) -> None:
        self.replay = work


@pytest.fixture
def pretended(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Recorded]:
    """A recorder that takes this machine for one with a GPU, and whose recordings are calls."""

    def make(calls: list[str], uses: list[Tensor], fails: bool = False) -> Recorded:
        recorded = Recorded(lambda: calls.append("work"), torch.device("cpu"), lambda: uses)
        recorded._on_gpu = True

        def record() -> Graph:
            if fails:
                try:
                    raise RuntimeError("operation not permitted\nwhen capturing")
                finally:
                    raise RuntimeError("capture is invalid")
            calls.append("record")
            return Graph(lambda: calls.append("replay"))

        for name, own in (("_warm_up", recorded._work), ("_record", record)):
            monkeypatch.setattr(recorded, name, own)
        monkeypatch.setattr(recorded, "_replay", lambda: recorded._graph.replay())
        monkeypatch.setattr("bumblebee.learning.ppo.update_graph._as_before", lambda device: contextlib.nullcontext())
        return recorded

    return make


def test_a_recording_is_renewed_when_a_tensor_has_moved(pretended: Callable[..., Recorded]) -> None:
    """Another storage or a loaded state of Adam; as long as all stays in place it is replayed."""
    calls, uses = [], [torch.zeros(2), torch.zeros(3)]
    recorded = pretended(calls, uses)
    for _ in range(5):
        recorded.renew()
        recorded()
    assert calls == ["work"] * 3 + ["record", "replay", "replay"]
    uses[1] = torch.zeros(4)
    calls.clear()
    for _ in range(4):
        recorded.renew()
        recorded()
    assert calls == ["work"] * 3 + ["record", "replay"]


def test_ranks_that_part_free_their_recordings(pretended: Callable[..., Recorded]) -> None:
    """NCCL's end waits for graphs that hold its exchanges; work after that is not a replay."""
    calls: list[str] = []
    recorded = pretended(calls, [])
    for _ in range(5):
        recorded()
    forget_recordings()
    assert recorded._graph is None
    calls.clear()
    recorded()
    assert calls == ["work"]


def test_a_recording_that_fails_is_told_once_and_work_goes_on(
    pretended: Callable[..., Recorded], capsys: pytest.CaptureFixture[str]
) -> None:
    """Every call does the work once, and the line names what went wrong first."""
    calls: list[str] = []
    recorded = pretended(calls, [], fails=True)
    for _ in range(6):
        recorded.renew()
        recorded()
    assert calls == ["work"] * 6
    told = "update: no CUDA graph (operation not permitted); goes on without one"
    assert capsys.readouterr().err.splitlines() == [told]


@pytest.mark.gpu
@GPU
@pytest.mark.parametrize("symmetry", [False, True])
def test_the_graph_learns_what_the_same_steps_learn_without_one(
    symmetry: bool, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Recorded once, in the first update, and replayed in four more, while rate, normalisation and samples change."""
    record, recorded = Recorded._record, []

    def counted(step: Recorded) -> torch.cuda.CUDAGraph:
        recorded.append(step)
        return record(step)

    monkeypatch.setattr(Recorded, "_record", counted)
    config = replace(CONFIG, captured=True, desired_kl=1e-5)
    graph, eager = (algorithm(config, "cuda:0", symmetry) for _ in range(2))
    eager._device_update._step._on_gpu = False
    came, expected = learned(graph, 5, "cuda:0"), learned(eager, 5, "cuda:0")
    assert graph._device_update._step._graph is not None and capsys.readouterr().err == ""
    assert recorded == [graph._device_update._step]
    for one, other in zip(expected, came, strict=True):
        assert other == pytest.approx(one, rel=1e-4, abs=1e-5)
    assert came[-1]["rate"] < config.learning_rate
    for name, value in networks(eager).items():
        torch.testing.assert_close(networks(graph)[name], value, rtol=1e-4, atol=1e-5, msg=name)


@pytest.mark.gpu
@GPU
@pytest.mark.parametrize("symmetry", [False, True])
def test_the_graph_on_a_gpu_is_the_update_of_the_cpu(symmetry: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """After one update, half of whose gradient steps are replayed; the samples come in the same order."""
    config, order = replace(CONFIG, captured=True), torch.randperm
    torch.set_float32_matmul_precision("highest")
    monkeypatch.setattr(torch, "randperm", lambda count, device: order(count).to(device))
    here, there = algorithm(config, symmetry=symmetry), algorithm(config, "cuda:0", symmetry)
    there.load(here.save(), None, True)
    expected, came = learned(here, 1), learned(there, 1, "cuda:0")
    assert there._device_update._step._graph is not None
    assert came[0] == pytest.approx(expected[0], rel=1e-3, abs=1e-4)
    for name, value in networks(here).items():
        torch.testing.assert_close(networks(there)[name].cpu(), value, rtol=1e-3, atol=1e-4, msg=name)


@pytest.mark.gpu
@GPU
def test_a_recording_that_breaks_off_leaves_the_gpu_as_it_was(capsys: pytest.CaptureFixture[str]) -> None:
    """A step that looks at the device cannot be recorded: one line, the same learning, and random numbers go on."""
    config = replace(CONFIG, captured=True)
    whole, broken = algorithm(config, "cuda:0"), algorithm(config, "cuda:0")
    update = broken._device_update
    differentiate = update._whole

    def looking() -> None:
        differentiate()
        float(update._kl)

    update._step._work = looking
    stream = torch.cuda.current_stream()
    for ppo in (whole, broken):
        learned(ppo, 2, "cuda:0")
    assert capsys.readouterr().err.count("\n") == 1 and update._step._graph is None
    assert torch.cuda.current_stream() == stream and torch.isfinite(torch.randn(3, device="cuda")).all()
    for name, value in networks(whole).items():
        torch.testing.assert_close(networks(broken)[name], value, rtol=1e-3, atol=1e-4, msg=name)
