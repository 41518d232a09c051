"""The captured update: rsl_rl's mathematics, read once an iteration, and exact to go on from."""

import contextlib
import io
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

from bumblebee.learning.config import PpoConfig
from bumblebee.learning.ppo.bounded import BoundedPpo
from bumblebee.learning.ppo.learner import runner_config
from bumblebee.learning.ppo.update_graph import Recorded
from bumblebee.learning.ppo.update_step import next_rate
from bumblebee.learning.ranks import Ranks
from tests.learning.ppo.test_ppo import PPO_CONFIG, model, trainer, weights  # noqa: F401

WORLDS, STEPS, SEEN, KNOWN, ACTIONS = 6, 4, 5, 7, 3
CONFIG = PpoConfig(steps=STEPS, epochs=2, mini_batches=3, hidden=(8, 8), learning_rate_range=(1e-4, 5e-2))


def mirror(env: object, obs: TensorDict | None, actions: Tensor | None) -> tuple[TensorDict | None, Tensor | None]:
    """A reflection that turns every sign."""
    if obs is not None:
        seen = {name: torch.cat((values, -values)) for name, values in obs.items()}
        obs = TensorDict(seen, batch_size=[2 * len(obs)])
    return obs, None if actions is None else torch.cat((actions, -actions))


def algorithm(
    config: PpoConfig, device: str = "cpu", symmetry: bool = False, ranks: int = 1, **more: Any
) -> BoundedPpo:
    """With networks that a seed gives."""
    settings = runner_config(config) | {"multi_gpu": Ranks(0, ranks).settings}
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


def test_processes_that_saw_the_same_learn_what_one_would(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two of them: gradients and divergence are exchanged between the passes, to the bit."""
    config = replace(CONFIG, captured=True, desired_kl=5e-4)  # a twice as large divergence would be beyond it
    alone, together = algorithm(config), algorithm(config, ranks=2)
    exchanged = []

    def doubled(values: Tensor, op: object = None) -> None:
        exchanged.append(values.numel())
        values.mul_(2)

    monkeypatch.setattr(torch.distributed, "all_reduce", doubled)
    assert learned(together, 3) == learned(alone, 3)
    for name, value in networks(alone).items():
        assert torch.equal(networks(together)[name], value), name
    weights = sum(parameter.numel() for one in (alone.actor, alone.critic) for parameter in one.parameters())
    assert exchanged == [weights, 1] * (3 * CONFIG.epochs * CONFIG.mini_batches)


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
