"""Trains a delta action by PPO on recorded rollouts (paper, section 3.3.2; ASAP's scheme)."""

import contextlib
import io
from collections.abc import Callable
from typing import Any

import pandas as pd
import torch
from rsl_rl.runners import OnPolicyRunner

from bumblebee.learning.delta.action import DeltaAction, DeltaConfig, make_network
from bumblebee.learning.delta.env import DeltaEnv
from bumblebee.learning.ppo.learner import BoundedPpo, runner_config


def train_delta(
    env: DeltaEnv, config: DeltaConfig, report: Callable[[int, str], None] = lambda frames, note: None
) -> tuple[DeltaAction, pd.DataFrame]:
    """Train for `config.ppo.iterations` updates.

    Args:
        env: replays the training rollouts.
        config: see `DeltaConfig`.
        report: called after each iteration with its frames and a short note.

    Returns:
        The delta action and the curve: iteration, frames, reward (mean of a step), lost (share of the steps).
    """
    torch.manual_seed(config.seed)
    with contextlib.redirect_stdout(io.StringIO()):  # rsl_rl prints both networks
        runner = OnPolicyRunner(env, runner_config(config.ppo), log_dir=None, device=env.device)
    algorithm: BoundedPpo = runner.alg
    _start_at_zero(algorithm.actor.mlp)
    algorithm.train_mode()
    frames_each, rows = config.ppo.steps * config.num_envs, []
    for iteration in range(1, config.ppo.iterations + 1):
        rewards, lost = _collect(env, algorithm, config.ppo.steps)
        algorithm.update()
        rows.append({"iteration": iteration, "frames": iteration * frames_each, "reward": rewards, "lost": lost})
        report(frames_each, f"reward {rewards:.4f}, lost {lost:.3f}")
    return _extract(algorithm.actor, config), pd.DataFrame(rows)


def _start_at_zero(mlp: torch.nn.Sequential) -> None:
    last = [layer for layer in mlp if isinstance(layer, torch.nn.Linear)][-1]
    torch.nn.init.zeros_(last.weight)
    torch.nn.init.zeros_(last.bias)


def _collect(env: DeltaEnv, algorithm: BoundedPpo, steps: int) -> tuple[float, float]:
    total, lost = 0.0, 0.0
    with torch.inference_mode():
        observations = env.get_observations()
        for _ in range(steps):
            observations, rewards, dones, extras = env.step(algorithm.act(observations))
            algorithm.process_env_step(observations, rewards, dones, extras)
            total += float(rewards.mean())
            lost += extras["log"]["lost"]
        algorithm.compute_returns(observations)
    return total / steps, lost / steps


def _extract(actor: Any, config: DeltaConfig) -> DeltaAction:
    network = make_network(config.ppo.hidden, len(config.joints))
    delta = DeltaAction(network, config.joints, config.limit)
    delta.normaliser.mean.copy_(actor.obs_normalizer._mean[0])
    delta.normaliser.std.copy_(actor.obs_normalizer._std[0] + actor.obs_normalizer.eps)
    trained = [layer for layer in actor.mlp if isinstance(layer, torch.nn.Linear)]
    empty = [layer for layer in network if isinstance(layer, torch.nn.Linear)]
    for source, target in zip(trained, empty, strict=True):
        target.load_state_dict(source.state_dict())
    return delta
