"""One gradient step of PPO as functions of tensors that never wait for the device, after rsl_rl's `PPO.update`.

M is the number of samples of a mini-batch, A the same with their reflections (2 M, or M without symmetry), J joints.
"""

from dataclasses import dataclass

import torch
from rsl_rl.algorithms import PPO
from rsl_rl.storage import RolloutStorage
from tensordict import TensorDict
from torch import Tensor

FACTOR = 1.5  # of the learning rate, when the KL divergence is off its target
LEAST, MOST = 1e-5, 1e-2  # rsl_rl's own bounds of an adapted rate


@dataclass(frozen=True)
class Losses:
    """Losses of one mini-batch, scalars on the device."""

    total: Tensor
    """Loss that is differentiated."""
    told: tuple[Tensor, ...]
    """Value, surrogate, entropy and, with symmetry, how far the actor is from being symmetric."""
    kl: Tensor | None
    """Divergence of the actions' distribution from the one that acted; None if the rate is fixed."""


@torch.no_grad()
def gathered(storage: RolloutStorage, advantages: Tensor, rows: Tensor) -> RolloutStorage.Batch:
    """The samples `rows` (M,) of all steps and worlds; `advantages` (steps * worlds, 1).

    All tensors are new ones: what was stored in inference mode could not be kept for a backward pass.
    """

    def of(stored: Tensor) -> Tensor:
        return stored.flatten(0, 1).index_select(0, rows)

    seen = {name: of(values) for name, values in storage.observations.items()}
    parameters = storage.distribution_params
    assert parameters is not None
    return RolloutStorage.Batch(
        observations=TensorDict(seen, batch_size=[len(rows)]),
        actions=of(storage.actions),
        values=of(storage.values),
        advantages=advantages.index_select(0, rows),
        returns=of(storage.returns),
        old_actions_log_prob=of(storage.actions_log_prob),
        old_distribution_params=tuple(of(values) for values in parameters),
    )


def losses(algorithm: PPO, batch: RolloutStorage.Batch) -> Losses:
    """Forward passes of actor and critic on a mini-batch, which is extended by its reflections in place.

    Actions are not drawn, and the actor's means serve the symmetry's loss too; rsl_rl computes them again for it.
    """
    actor, size = algorithm.actor, len(batch.actions)
    if algorithm.symmetry:
        with torch.no_grad():
            algorithm.symmetry.augment_batch(batch, size)
    means = actor.mlp(actor.get_latent(batch.observations))
    distribution = actor.distribution
    assert distribution is not None
    distribution.update(means)
    entropy = distribution.entropy[:size].mean()
    surrogate = _surrogate_loss(distribution.log_prob(batch.actions), batch, algorithm.clip_param)
    value = _value_loss(algorithm.critic(batch.observations), batch, algorithm.clip_param)
    total = surrogate + algorithm.value_loss_coef * value - algorithm.entropy_coef * entropy
    told = [value, surrogate, entropy]
    with torch.no_grad():
        kl = _divergence(algorithm, batch, size) if algorithm.schedule == "adaptive" else None
        if algorithm.symmetry:
            told.append(_asymmetry(algorithm, means.detach(), size))
        # Else it would hold this pass, and with it autograd's nodes of the parameters, until somebody acts.
        distribution.update(means.detach())
    return Losses(total, tuple(loss.detach() for loss in told), kl)


def next_rate(rate: Tensor, kl: Tensor, target: tuple[Tensor, Tensor], bounds: tuple[float, float]) -> Tensor:
    """The adapted learning rate: a third less above the `target` range of the divergence, half as much more below it.

    Where the divergence is 0 or no number the rate stays. Scalars on the device.
    """
    least, most = bounds
    slower = (rate / FACTOR).clamp(min=LEAST).clamp(least, most)
    faster = (rate * FACTOR).clamp(max=MOST).clamp(least, most)
    low, high = target
    return torch.where(kl > high, slower, torch.where((kl < low) & (kl > 0), faster, rate))


def _surrogate_loss(log_prob: Tensor, batch: RolloutStorage.Batch, clip: float) -> Tensor:
    """The clipped objective; `log_prob` (A,) of the actions that were taken."""
    advantages = batch.advantages[:, 0]
    ratio = torch.exp(log_prob - batch.old_actions_log_prob[:, 0])
    return torch.max(-advantages * ratio, -advantages * ratio.clamp(1.0 - clip, 1.0 + clip)).mean()


def _value_loss(values: Tensor, batch: RolloutStorage.Batch, clip: float) -> Tensor:
    """The larger of the squared errors of the values (A, 1) and of the values clipped to near the old ones."""
    clipped = batch.values + (values - batch.values).clamp(-clip, clip)
    return torch.max((values - batch.returns).pow(2), (clipped - batch.returns).pow(2)).mean()


def _divergence(algorithm: PPO, batch: RolloutStorage.Batch, size: int) -> Tensor:
    now = tuple(values[:size].detach() for values in algorithm.actor.output_distribution_params)
    return algorithm.actor.get_kl_divergence(batch.old_distribution_params, now).mean()


def _asymmetry(algorithm: PPO, means: Tensor, size: int) -> Tensor:
    """Mean square between what the actor does in the mirror and the reflection of what it does; means (A, J)."""
    symmetry = algorithm.symmetry
    _, wanted = symmetry.data_augmentation_func(env=symmetry.env, obs=None, actions=means[:size])
    return torch.nn.functional.mse_loss(means[size:], wanted[size:])
