"""The captured update: rsl_rl's mathematics, read once an iteration, and exact to go on from; a GPU's is the CPU's."""

import contextlib
import io
from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import pytest
import torch
from tensordict import TensorDict
from torch import Tensor
from torch.nn.utils import parameters_to_vector
from torch.utils._python_dispatch import TorchDispatchMode

from bumblebee.learning.bounded_ppo import BoundedPpo
from bumblebee.learning.config import PpoConfig
from bumblebee.learning.ppo import runner_config
from bumblebee.learning.update_graph import Recorded
from bumblebee.learning.update_step import next_rate
from tests.learning.test_ppo import PPO_CONFIG, model, trainer, weights  # noqa: F401

WORLDS, STEPS, SEEN, KNOWN, ACTIONS = 6, 4, 5, 7, 3
CONFIG = PpoConfig(steps=STEPS, epochs=2, mini_batches=3, hidden=(8, 8), learning_rate_range=(1e-4, 5e-2))
GPU = pytest.mark.skipif(not torch.cuda.is_available(), reason="no NVIDIA GPU")


def mirror(env: object, obs: TensorDict | None, actions: Tensor | None) -> tuple[TensorDict | None, Tensor | None]:
    """A reflection that turns every sign."""
    if obs is not None:
        seen = {name: torch.cat((values, -values)) for name, values in obs.items()}
        obs = TensorDict(seen, batch_size=[2 * len(obs)])
    return obs, None if actions is None else torch.cat((actions, -actions))


def algorithm(config: PpoConfig, device: str = "cpu", symmetry: bool = False, **more: Any) -> BoundedPpo:
    """With networks that a seed gives."""
    settings = runner_config(config) | {"multi_gpu": None}
    settings["algorithm"] |= more
    if symmetry:
        augmentation = {"use_data_augmentation": True, "data_augmentation_func": mirror}
        settings["algorithm"]["symmetry_cfg"] = augmentation
    torch.manual_seed(1)
    env = SimpleNamespace(num_envs=WORLDS, num_actions=ACTIONS)
    with contextlib.redirect_stdout(io.StringIO()):
        made = BoundedPpo.construct_algorithm(observations(0, device), env, settings, device)
    made.train_mode()
    return made


def observations(seed: int, device: str = "cpu") -> TensorDict:
    generator = torch.Generator().manual_seed(seed)
    seen = {"policy": torch.randn(WORLDS, SEEN, generator=generator)}
    seen["critic"] = 2 + 3 * torch.randn(WORLDS, KNOWN, generator=generator)
    return TensorDict(seen, batch_size=[WORLDS]).to(device)


def rollout(ppo: BoundedPpo, seed: int, device: str = "cpu") -> None:
    """Steps in inference mode, as a trainer does them; the noise is drawn on the CPU, alike for all devices."""
    generator = torch.Generator().manual_seed(seed)
    with torch.inference_mode():
        for step in range(STEPS):
            ppo.act(observations(100 * seed + step, device))
            noise = torch.randn(WORLDS, ACTIONS, generator=generator).to(device)
            actions = ppo.actor.output_mean + ppo.actor.output_std * noise
            ppo.transition.actions = actions
            ppo.transition.actions_log_prob = ppo.actor.get_output_log_prob(actions)
            rewards = (-actions.square()).sum(1)
            dones = torch.rand(WORLDS, generator=generator).to(device) < 0.2
            ppo.process_env_step(observations(0, device), rewards, dones, {"time_outs": 0.5 * dones.float()})
        ppo.compute_returns(observations(100 * seed + STEPS, device))


def learned(ppo: BoundedPpo, updates: int, device: str = "cpu") -> list[dict[str, float]]:
    told = []
    for turn in range(1, updates + 1):
        rollout(ppo, turn, device)
        torch.manual_seed(turn)  # of the order of the samples: rsl_rl draws actions in between, too
        told.append(ppo.update() | {"rate": ppo.learning_rate})
    return told


def networks(ppo: BoundedPpo) -> dict[str, Tensor]:
    both = {"actor": ppo.actor, "critic": ppo.critic}
    return {f"{name}.{key}": value for name, one in both.items() for key, value in one.state_dict().items()}


@pytest.mark.parametrize("updates", [1, 5])
@pytest.mark.parametrize("symmetry", [False, True])
@pytest.mark.parametrize("changes", [{"desired_kl": 1e-5}, {"desired_kl": 0.5}, {"schedule": "fixed"}])
def test_it_is_the_update_of_rsl_rl(updates: int, symmetry: bool, changes: dict[str, Any]) -> None:
    """Weights, deviations, normalisation, learning rate and losses, whether the rate falls, rises or stays."""
    config = replace(CONFIG, **changes)
    theirs, ours = algorithm(config, symmetry=symmetry), algorithm(replace(config, captured=True), symmetry=symmetry)
    before = parameters_to_vector(ours.actor.parameters()).clone()
    expected, came = learned(theirs, updates), learned(ours, updates)
    for one, other in zip(expected, came, strict=True):
        assert other == pytest.approx(one, rel=1e-4, abs=1e-5)
        assert other["rate"] == one["rate"]
    for name, value in networks(theirs).items():
        torch.testing.assert_close(networks(ours)[name], value, rtol=1e-4, atol=1e-5, msg=name)
    assert (parameters_to_vector(ours.actor.parameters()) - before).abs().max() > 1e-3
    rates = [told["rate"] for told in came]
    moved = {1e-5: rates[0] < CONFIG.learning_rate, 0.5: rates[0] > CONFIG.learning_rate}
    assert moved.get(changes.get("desired_kl"), set(rates) == {CONFIG.learning_rate})


def test_the_rate_follows_the_divergence_as_in_rsl_rl() -> None:
    """Down, up or neither, also at a divergence of zero or of no number, and within both ranges of bounds."""
    target = torch.tensor(0.005), torch.tensor(0.02)
    cases = [
        (1e-3, 0.03, (1e-4, 2e-3), 1e-3 / 1.5),
        (1e-3, 0.001, (1e-4, 2e-3), 1.5e-3),
        (1e-3, 0.01, (1e-4, 2e-3), 1e-3),
        (1e-3, 0.0, (1e-4, 2e-3), 1e-3),
        (1e-3, float("nan"), (1e-4, 2e-3), 1e-3),
        (1e-4, 0.03, (1e-4, 2e-3), 1e-4),
        (2e-3, 0.001, (1e-4, 2e-3), 2e-3),
        (1e-5, 0.03, (1e-7, 1.0), 1e-5),
        (9e-3, 0.001, (1e-7, 1.0), 1e-2),
    ]
    for rate, divergence, bounds, expected in cases:
        came = next_rate(torch.tensor(rate, dtype=torch.float64), torch.tensor(divergence), target, bounds)
        assert float(came) == expected, (rate, divergence)


class NoLooking(TorchDispatchMode):
    """Refuses what makes the host wait for the device: reading a number, and shapes that depend on values."""

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        if func.overloadpacket.__name__ in ("_local_scalar_dense", "nonzero", "masked_select", "equal", "_unique2"):
            raise AssertionError(f"waits for the device: {func}")
        return func(*args, **(kwargs or {}))


@pytest.mark.parametrize("symmetry", [False, True])
def test_a_gradient_step_never_asks_the_device(symmetry: bool) -> None:
    """Forward and backward pass, losses, learning rate and clipping; Adam itself is torch's, and looks on a CPU."""
    ppo = algorithm(replace(CONFIG, captured=True), symmetry=symmetry)
    rollout(ppo, 1)
    ppo.optimizer.step = lambda: None
    with NoLooking(), pytest.raises(AssertionError, match="waits"):
        float(torch.ones(1))
    with NoLooking():
        ppo._device_update._whole()
    assert all(parameter.grad is not None for parameter in ppo.actor.parameters())


def test_nothing_holds_the_last_backward_pass() -> None:
    """A distribution that kept it would keep autograd's nodes of the parameters, with the stream of their first use."""
    ppo = algorithm(replace(CONFIG, captured=True))
    learned(ppo, 1)
    assert not ppo.actor.output_mean.requires_grad and not ppo.actor.output_std.requires_grad


def test_what_a_recording_reads_stays_where_it_is() -> None:
    """From the second update on: the networks, the normalisation, Adam's state and what is stored."""
    ppo = algorithm(replace(CONFIG, captured=True))
    learned(ppo, 1)
    update = ppo._device_update
    names = [*update._uses()]
    kept = [tensor for tensor in names if tensor is not None and not any(tensor is g for g in gradients(ppo))]
    before = [tensor.data_ptr() for tensor in kept]
    rollout(ppo, 2)
    ppo.update()
    after = [tensor for tensor in update._uses() if tensor is not None and not any(tensor is g for g in gradients(ppo))]
    assert [tensor.data_ptr() for tensor in after] == before and len(before) > 40


def gradients(ppo: BoundedPpo) -> list[Tensor | None]:
    return [parameter.grad for one in (ppo.actor, ppo.critic) for parameter in one.parameters()]


def test_a_step_can_be_differentiated_within_inference_mode_left_for_it() -> None:
    """A recording begins in inference mode, for the generators' sake, and leaves it for the work."""
    inside, outside = algorithm(replace(CONFIG, captured=True)), algorithm(replace(CONFIG, captured=True))
    work = inside._device_update._whole

    def nested() -> None:
        with torch.inference_mode(), torch.inference_mode(False):
            work()

    inside._device_update._step = Recorded(nested, torch.device("cpu"), list)
    learned(inside, 2)
    learned(outside, 2)
    for name, value in networks(outside).items():
        assert torch.equal(networks(inside)[name], value)
        assert not networks(inside)[name].is_inference()


@pytest.mark.parametrize("first", [False, True])
def test_a_checkpoint_of_either_update_goes_on_in_either(first: bool) -> None:
    """Adam's moments, its count and the rate come back; the next updates are the same up to rounding."""
    origin = algorithm(replace(CONFIG, captured=first))
    learned(origin, 2)
    saved = origin.save()
    assert isinstance(saved["optimizer_state_dict"]["param_groups"][0]["lr"], float)
    again = [algorithm(replace(CONFIG, captured=captured)) for captured in (False, True)]
    for ppo in again:
        ppo.load(deepcopy(saved), None, True)  # Adam takes the tensors that it is given for its own
        assert ppo.learning_rate == origin.learning_rate != CONFIG.learning_rate
        learned(ppo, 1)
    theirs, ours = (networks(ppo) for ppo in again)
    for name, value in theirs.items():
        torch.testing.assert_close(ours[name], value, rtol=1e-4, atol=1e-5, msg=name)
    assert again[1].optimizer.param_groups[0]["lr"] is again[1]._device_update._adam_rate


def test_a_killed_captured_training_goes_on_as_if_it_had_not_been_killed(model: mujoco.MjModel, tmp_path: Path) -> None:  # noqa: F811
    """To the bit, with symmetry and the adaptive rate."""
    config = replace(PPO_CONFIG, captured=True, symmetry=True)
    whole = trainer(model, tmp_path / "whole", config)
    whole.train()
    first = trainer(model, tmp_path / "cut", config)
    first.train(enough=lambda: first.iteration == 3)  # the checkpoint is of iteration 2
    again = trainer(model, tmp_path / "cut", config)
    assert again.iteration == 2
    again.train()
    assert torch.equal(weights(whole), weights(again))
    assert whole.algorithm.learning_rate == again.algorithm.learning_rate != config.learning_rate


def test_what_it_lacks_is_said_in_one_line_and_rsl_rl_updates(capsys: pytest.CaptureFixture[str]) -> None:
    """An algorithm of another kind trains as before."""
    other = algorithm(replace(CONFIG, captured=True), normalize_advantage_per_mini_batch=True)
    assert capsys.readouterr().err.splitlines() == [
        "update: rsl_rl's own, since the captured one lacks advantages normalised by mini-batch"
    ]
    assert other._device_update is None and learned(other, 1)[0]["value"] > 0


class Graph:
    """What a recording is without a GPU."""

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
        monkeypatch.setattr("bumblebee.learning.update_graph._as_before", lambda device: contextlib.nullcontext())
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
def test_the_graph_on_a_gpu_is_the_update_of_the_cpu(symmetry: bool, capsys: pytest.CaptureFixture[str]) -> None:
    """Recorded in the first update, replayed in four more; rollouts are the same on both."""
    config = replace(CONFIG, captured=True, desired_kl=1e-5)
    torch.set_float32_matmul_precision("highest")
    here, there = algorithm(config, symmetry=symmetry), algorithm(config, symmetry=symmetry)
    on_gpu = algorithm(config, "cuda:0", symmetry)
    on_gpu.load(here.save(), None, True)
    order = torch.randperm
    for ppo, device in ((here, "cpu"), (on_gpu, "cuda:0")):

        def alike(count: int, device: str = device, **more: Any) -> Tensor:
            return order(count).to(device)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(torch, "randperm", alike)
            told = learned(ppo, 5, device)
        rates = [one["rate"] for one in told]
        assert rates[0] < config.learning_rate
    assert on_gpu._device_update._step._graph is not None and capsys.readouterr().err == ""
    for name, value in networks(here).items():
        torch.testing.assert_close(networks(on_gpu)[name].cpu(), value, rtol=1e-3, atol=1e-4, msg=name)
    assert any(not torch.equal(networks(there)[name], value) for name, value in networks(here).items())


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
