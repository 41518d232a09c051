"""DAgger from all experts into one generalist (paper, section 3.4 and the table "Hyperparameters for DAgger").

The generalist acts, the expert of each motion's cluster says what it would have done there, and the generalist learns
from everything gathered so far by KL(general || expert). Clusters are drawn with equal shares, whatever fails (appendix
D: "each category is equally represented"): the environment's `clip_share` is `ClipShares.equal`.

A teacher and its student are the same with one expert and two observations: in an environment with a group "student",
the experts answer what they see in "policy", and who learns sees "student".
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

import pandas as pd
import torch
from rsl_rl.models import MLPModel
from torch import Tensor

from bumblebee.learning.policy import Policy, Shape, new_actor, shape_of
from bumblebee.ranges import Count, Few, Positive, Range, Ranged, Rate, Seed, Share, Widths
from bumblebee.tracking.config import EnvConfig
from bumblebee.tracking.env import TrackingEnv


@dataclass(frozen=True)
class DistillConfig(Ranged):
    """Distillation of the experts into the generalist."""

    iterations: Count = 300
    """Rounds of collecting and learning."""
    steps: Annotated[int, Range(least=1, most=10000)] = 8
    """Control steps of each world a round; with 512 worlds that is the paper's batch of 4096."""
    epochs: Few = 2
    """Passes over a round's number of samples, drawn from all that was gathered."""
    mini_batches: Annotated[int, Range(least=1, most=10000)] = 4
    """Gradient steps a pass."""
    learning_rate: Rate = 5e-4
    """Adam's rate; the paper's is 1e-4 with many more samples."""
    grad_norm: Positive = 1.0
    """Gradients are scaled down to this norm."""
    capacity: Annotated[int, Range(least=1, most=100000000)] = 400_000
    """Samples that are kept; the oldest go first."""
    expert_share: Share = 0.5
    """Share of the worlds in which the expert acts at first; falls to 0 over the first half."""
    init: Literal["base", "scratch"] = "base"
    """Start from the base policy or from nothing; a student with an observation of its own starts from nothing."""
    hidden: Widths = (256, 256, 128)
    """Layers of a generalist from scratch; from base they are base's."""
    seed: Seed = 0
    """Seed of the draws and of the network."""
    env: EnvConfig = field(default_factory=EnvConfig)
    """The environment it learns in."""

    def __post_init__(self) -> None:
        """Refuse a store that does not hold one step of all worlds, and batches smaller than their parts."""
        super().__post_init__()
        worlds = self.env.num_worlds
        self.require(self.capacity >= worlds, "capacity", f"at least env.num_worlds, {worlds}")
        self.require(worlds * self.steps >= self.mini_batches, "mini_batches", f"at most {worlds * self.steps} samples")


PAPER_DAGGER = DistillConfig(steps=1, learning_rate=1e-4, init="scratch", hidden=(1024, 1024, 512))
"""Appendix B, "Hyperparameters for DAgger": Adam 1e-4, batch 4096 (a step of 4096 worlds), 2 epochs of 4 mini-batches,
gradient norm 1; the paper's MLP."""


def gaussian_kl(mean: Tensor, std: Tensor, other_mean: Tensor, other_std: Tensor) -> Tensor:
    """KL( N(mean, std^2) || N(other_mean, other_std^2) ), diagonal, summed over the last dimension.

    Args:
        mean: (B, J) of the first distribution, `std` (B, J) or (J,).
        std: see `mean`.
        other_mean: (B, J) of the second one, `other_std` likewise.
        other_std: see `other_mean`.
    """
    ratio = (std / other_std).square()
    shift = ((mean - other_mean) / other_std).square()
    return 0.5 * (ratio + shift - 1.0 - ratio.log()).sum(dim=-1)


def gaussian(actor: MLPModel, observation: Tensor) -> tuple[Tensor, Tensor]:
    """Mean (B, J) and standard deviation (B, J) of an actor's action."""
    actor.distribution.update(actor.mlp(actor.get_latent({"policy": observation})))
    return actor.output_mean, actor.output_std


class Aggregate:
    """The data set that DAgger aggregates: a ring of observations with the experts' answers."""

    def __init__(self, capacity: int, observation: int, actions: int, device: torch.device | str = "cpu") -> None:
        self.observation = torch.zeros(capacity, observation, device=device)
        self.mean, self.std = (torch.zeros(capacity, actions, device=device) for _ in range(2))
        self.capacity, self.size, self._next = capacity, 0, 0

    def add(self, observation: Tensor, mean: Tensor, std: Tensor) -> None:
        """Append B samples; beyond the capacity the oldest are overwritten."""
        rows = (self._next + torch.arange(len(observation), device=observation.device)) % self.capacity
        self.observation[rows], self.mean[rows], self.std[rows] = observation, mean, std
        self._next = int((self._next + len(observation)) % self.capacity)
        self.size = min(self.size + len(observation), self.capacity)

    def draw(self, count: int, generator: torch.Generator) -> tuple[Tensor, Tensor, Tensor]:
        """Draw `count` samples, with replacement."""
        rows = torch.randint(self.size, (count,), generator=generator, device=generator.device)
        return self.observation[rows], self.mean[rows], self.std[rows]


def distill(
    env: TrackingEnv,
    experts: Mapping[int, Policy],
    cluster: Sequence[int],
    config: DistillConfig,
    base: Policy | None = None,
    report: Callable[[int, str], None] = lambda frames, note: None,
    enough: Callable[[], bool] = lambda: False,
) -> tuple[Policy, pd.DataFrame]:
    """Distil.

    Args:
        env: follows the training clips of all clusters.
        experts: cluster index -> its expert.
        cluster: (N,) cluster index of each clip of `env.library`.
        config: see `DistillConfig`.
        base: gives the start (`init: base`) and the sizes; nothing for a student with an observation of its own.
        report: called after each round with its frames and a short note.
        enough: asked after each round whether to stop.

    Returns:
        The generalist, and the curve: iteration, frames, kl, success, key_error.
    """
    torch.manual_seed(config.seed)
    generator = torch.Generator(env.device).manual_seed(config.seed)
    student, shape = _student(env, base, config)
    experts = {index: expert.to(env.device) for index, expert in experts.items()}
    optimiser = torch.optim.Adam(student.parameters(), lr=config.learning_rate)
    data = Aggregate(config.capacity, shape.observation, shape.actions, env.device)
    of_clip, rows = torch.as_tensor(cluster, device=env.device), []
    frames_each = config.steps * env.num_envs
    for iteration in range(config.iterations):
        env.progress = 1.0  # the success threshold at its final value
        share = config.expert_share * max(0.0, 1.0 - 2.0 * iteration / config.iterations)
        _collect(env, student, experts, of_clip, data, config, share, generator)
        env.engine.check()
        kl = _learn(student, optimiser, data, frames_each, config, generator)
        scalars = env.statistics.take()
        kept = {name: scalars[name] for name in ("success", "key_error")}
        rows.append({"iteration": iteration + 1, "frames": (iteration + 1) * frames_each, "kl": kl, **kept})
        report(frames_each, f"KL {kl:.3f}, success {kept['success']:.2f}")
        if enough():
            break
    student.eval()
    critic = base.critic_state if base is not None and _group(env) == "policy" else {}
    return Policy(student.cpu(), critic, shape), pd.DataFrame(rows)


def _student(env: TrackingEnv, base: Policy | None, config: DistillConfig) -> tuple[MLPModel, Shape]:
    """Who learns, on the environment's device, and its shape."""
    if base is None or _group(env) == "student":
        shape = shape_of(env, config.hidden, _group(env))
        return new_actor(shape).to(env.device).train(), shape
    shape = replace(base.shape, hidden=tuple(config.hidden)) if config.init == "scratch" else base.shape
    if config.init == "base":
        student = new_actor(base.shape)
        student.load_state_dict(base.actor.state_dict())
    else:
        student = new_actor(shape)
        student.obs_normalizer.load_state_dict(base.actor.obs_normalizer.state_dict())
    student.obs_normalizer.eval()  # the statistics stay those of base's training
    return student.to(env.device), shape


def _group(env: TrackingEnv) -> str:
    """The observations of who learns."""
    return "student" if "student" in env.groups else "policy"


@torch.no_grad()
def _collect(
    env: TrackingEnv,
    student: MLPModel,
    experts: Mapping[int, Policy],
    of_clip: Tensor,
    data: Aggregate,
    config: DistillConfig,
    expert_share: float,
    generator: torch.Generator,
) -> None:
    for _ in range(config.steps):
        groups = env.get_observations()
        known, seen = groups["policy"], groups[_group(env)]
        student.update_normalization({"policy": seen})  # nothing where base's statistics stay
        wanted = torch.zeros(env.num_envs, env.num_actions, device=seen.device)
        spread = torch.ones_like(wanted)
        now = of_clip[env.clip]
        for index, expert in experts.items():
            own = (now == index).nonzero()[:, 0]
            if len(own):
                wanted[own], spread[own] = gaussian(expert.actor, known[own])
        data.add(seen, wanted, spread)
        leads = torch.rand(env.num_envs, 1, generator=generator, device=seen.device) < expert_share
        env.step(torch.where(leads, wanted, student({"policy": seen})))


def _learn(
    student: MLPModel,
    optimiser: torch.optim.Optimizer,
    data: Aggregate,
    samples: int,
    config: DistillConfig,
    generator: torch.Generator,
) -> float:
    batch, total = max(samples // config.mini_batches, 1), 0.0
    steps = config.epochs * config.mini_batches
    for _ in range(steps):
        seen, mean, std = data.draw(batch, generator)
        loss = gaussian_kl(*gaussian(student, seen), mean, std).mean()
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(student.parameters(), config.grad_norm)
        optimiser.step()
        total += float(loss.detach())
    return total / steps
