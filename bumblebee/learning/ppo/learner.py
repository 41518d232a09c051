"""PPO of rsl_rl as a learner in the tracking environment (paper, section 3.2).

rsl_rl's own `learn` prints a screen an iteration and forgets the environment in its checkpoints, so the loop is
`learner`'s; the steps between are rsl_rl's, unchanged, or its update is recorded (`update`).
"""

import contextlib
import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

from bumblebee.errors import BadInput
from bumblebee.learning.config import PpoConfig
from bumblebee.learning.gpu_memory import ppo_needs
from bumblebee.learning.learner import Learner, parent_policy
from bumblebee.learning.policy import Policy, model_config, new_actor, shape_of
from bumblebee.learning.ppo.bounded import BoundedPpo
from bumblebee.learning.ppo.update import TOLD
from bumblebee.learning.ranks import Ranks
from bumblebee.sim.warp_limits import within_memory
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.mirror import augmentation


def runner_config(config: PpoConfig) -> dict[str, Any]:
    """rsl_rl's configuration; it ignores keys that it does not know, so a test compares them with its signatures."""
    fixed = config.schedule == "fixed"
    algorithm = {
        "class_name": BoundedPpo,
        "learning_rate_range": (config.learning_rate,) * 2 if fixed else config.learning_rate_range,
        "captured": bool(config.captured),
        "num_learning_epochs": config.epochs,
        "num_mini_batches": config.mini_batches,
        "clip_param": config.clip,
        "gamma": config.gamma,
        "lam": config.lam,
        "value_loss_coef": config.value,
        "entropy_coef": config.entropy,
        "learning_rate": config.learning_rate,
        "max_grad_norm": config.grad_norm,
        "schedule": config.schedule,
        "desired_kl": config.desired_kl,
        "rnd_cfg": None,
        "symmetry_cfg": None,
    }
    return {
        "num_steps_per_env": config.steps,
        "obs_groups": {"actor": ["policy"], "critic": ["critic"]},
        "algorithm": algorithm,
        "actor": {"class_name": "MLPModel", **model_config(config.hidden, config.initial_std)},
        "critic": {"class_name": "MLPModel", **model_config(config.hidden, None)},
    }


class Trainer(Learner):
    """Trains one policy in `env` by PPO.

    Args:
        env: the task.
        config: the algorithm.
        folder: for the checkpoint and the curve; a checkpoint found there is continued.
        seed: of the network and of the actions' noise.
        parent: folder of a policy to start from, if any; a child has its parent's layers, whatever `config` says.
        ranks: the processes that train this policy together, each with such a trainer around its own worlds.
    """

    name = "ppo"

    def __init__(
        self,
        env: TrackingEnv,
        config: PpoConfig,
        folder: Path,
        seed: int = 0,
        parent: Path | None = None,
        ranks: Ranks | None = None,
    ) -> None:
        origin = None if parent is None else parent_policy(parent, env)
        if origin is not None:
            config = replace(config, hidden=origin.shape.hidden)
        super().__init__(env, config, folder, ranks)
        self._fit(ppo_needs(config, env.num_envs, self._groups(), env.num_actions))
        torch.manual_seed(seed)
        on_gpu = torch.device(env.device).type == "cuda"
        if config.captured is None:
            config = self.config = replace(config, captured=on_gpu and self.ranks.count == 1)
        if on_gpu:
            torch.set_float32_matmul_precision("high")
        with contextlib.redirect_stdout(io.StringIO()):  # it prints both networks
            settings = runner_config(config) | {"multi_gpu": self.ranks.settings}
            if config.symmetry:
                mirror = {"use_data_augmentation": True, "data_augmentation_func": augmentation(env)}
                settings["algorithm"]["symmetry_cfg"] = mirror
            with within_memory(env.num_envs):
                built = BoundedPpo.construct_algorithm(env.get_observations(), env, settings, env.device)
        assert isinstance(built, BoundedPpo)
        self.algorithm = built
        if origin is not None:
            self._start_from(origin, str(parent))
        if self.ranks.count > 1:
            self.algorithm.broadcast_parameters()
            torch.manual_seed(self.ranks.seed(seed))  # the networks are alike everywhere, the noise is not
        self.algorithm.train_mode()
        self._resume()

    @property
    def frames(self) -> int:
        """Control steps seen so far, of all worlds of all ranks."""
        return self.iteration * self.config.steps * self.env.num_envs * self.ranks.count

    def policy(self) -> Policy:
        """The policy as it is now; a copy."""
        shape = shape_of(self.env, self.config.hidden)
        actor = new_actor(shape)
        actor.load_state_dict(self.algorithm.actor.state_dict())
        critic = {name: tensor.cpu().clone() for name, tensor in self.algorithm.critic.state_dict().items()}
        return Policy(actor, critic, shape)

    def state_dict(self) -> dict[str, Any]:
        """Networks, optimiser and counts."""
        return {
            "algorithm": self.algorithm.save(),
            "learning_rate": self.algorithm.learning_rate,
            "iteration": self.iteration,
            "seconds": self._seconds,
        }

    def load_state_dict(self, saved: dict[str, Any]) -> None:
        """Go on from what `state_dict` gave."""
        self.algorithm.load(saved["algorithm"], None, True)
        self.algorithm.learning_rate = saved["learning_rate"]
        self.iteration, self._seconds = saved["iteration"], saved["seconds"]

    def _start_from(self, parent: Policy, name: str) -> None:
        if not parent.critic_state and not self.config.value_first:
            do = "Set `ppo.value_first: 20`: so many iterations the value learns alone; or `learner: world_model`."
            raise BadInput(f"{name}: critic", "a policy with its critic", "none", do)
        here, there = shape_of(self.env, self.config.hidden), parent.shape
        self.algorithm.actor.load_state_dict(parent.actor.state_dict())
        if not parent.critic_state:
            return
        if here.critic_observation != there.critic_observation:
            wanted = f"{here.critic_observation} entries as in `env`"
            raise BadInput(f"{name}: critic", wanted, str(there.critic_observation), "Start from another policy.")
        self.algorithm.critic.load_state_dict(parent.critic_state)

    def _iterate(self) -> dict[str, float]:
        config, algorithm, env = self.config, self.algorithm, self.env
        done = self.iteration / max(config.iterations, 1)
        env.progress = done
        algorithm.desired_kl = config.desired_kl + done * (config.desired_kl_end - config.desired_kl)
        with torch.inference_mode():
            observations = env.get_observations()
            for _ in range(config.steps):
                actions = algorithm.act(observations)
                observations, rewards, dones, extras = env.step(actions)
                algorithm.process_env_step(observations, rewards, dones, extras)
            algorithm.compute_returns(observations)
            std = float(algorithm.actor.output_std.mean())
        env.engine.check()
        losses = self._learn_value() if self.iteration < config.value_first else algorithm.update()
        self.ranks.add(env.statistics.sums)
        losses = self.ranks.mean({name: float(value) for name, value in losses.items()}, env.device)
        scalars = env.statistics.take() | {f"loss_{name}": value for name, value in losses.items()}
        scalars |= {"learning_rate": algorithm.learning_rate, "action_std": std, "threshold": env.threshold}
        if not np.isfinite(scalars["loss_value"]):
            raise FloatingPointError(f"the critic's loss is no number at iteration {self.iteration}")
        return scalars

    def _learn_value(self) -> dict[str, float]:
        """Fit the critic to what was collected, and leave the policy as it is; the losses, of which one counts."""
        algorithm, critic, total = self.algorithm, self.algorithm.critic, 0.0
        for batch in algorithm.storage.mini_batch_generator(self.config.mini_batches, self.config.epochs):
            loss = (critic(batch.observations) - batch.returns).square().mean()
            algorithm.optimizer.zero_grad()  # Adam leaves what has no gradient, as the actor here, where it is
            loss.backward()
            if algorithm.is_multi_gpu:
                algorithm.reduce_parameters()
            nn.utils.clip_grad_norm_(critic.parameters(), algorithm.max_grad_norm)
            algorithm.optimizer.step()
            total += loss.item()
        critic.update_normalization(algorithm.storage.observations.flatten(0, 1))
        algorithm.storage.clear()
        told = TOLD if algorithm.symmetry else TOLD[:-1]
        return dict.fromkeys(told, 0.0) | {"value": total / (self.config.mini_batches * self.config.epochs)}
