"""The world-model learner around the tracking environment: collect, fit the model, improve the policy through it."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from tensordict import TensorDict
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.learning.curve import CurveWriter
from bumblebee.learning.learner import Learner, parent_policy
from bumblebee.learning.policy import Policy, new_actor, shape_of
from bumblebee.learning.ranks import Ranks
from bumblebee.learning.world_model.accuracy import Accuracy, accuracy
from bumblebee.learning.world_model.collector import Collector
from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.learning.world_model.context import context_in, past_in
from bumblebee.learning.world_model.dynamics import Dynamics
from bumblebee.learning.world_model.gpu_memory import world_model_needs
from bumblebee.learning.world_model.imagination import Imagination
from bumblebee.learning.world_model.memory import Memory
from bumblebee.learning.world_model.model_update import ModelUpdate
from bumblebee.learning.world_model.policy_update import PolicyUpdate
from bumblebee.tracking.env import TrackingEnv

ERRORS = "model_error.csv"


class WorldModelTrainer(Learner):
    """Trains one policy in `env` through a model of it.

    Args:
        env: the task; its policy sees no history.
        config: the algorithm.
        folder: for the checkpoint and the curve; a checkpoint found there is continued.
        seed: of the networks and of the exploration.
        parent: folder of a policy to start from, if any; a child has its parent's layers, whatever `config` says.
        ranks: the processes that train this policy together, each with such a trainer around its own worlds.

    Raises:
        BadInput: for a task whose policy sees a history, too few worlds, or a parent of another shape; for windows or
            rollouts that are longer than episodes.
    """

    name = "world_model"

    def __init__(
        self,
        env: TrackingEnv,
        config: WorldModelConfig,
        folder: Path,
        seed: int = 0,
        parent: Path | None = None,
        ranks: Ranks | None = None,
    ) -> None:
        for name, expected, came in config.misfits(env.cfg, int(env.library.length.max()) - 1):
            raise BadInput(name, expected, str(came))
        origin = None if parent is None else parent_policy(parent, env)
        if origin is not None:
            config = replace(config, hidden=origin.shape.hidden)
        super().__init__(env, config, folder, ranks)
        torch.manual_seed(seed)
        device = torch.device(env.device)
        if device.type == "cuda":
            torch.set_float32_matmul_precision("high")
        self.shape = shape_of(env, config.hidden)
        actor = (origin.actor if origin is not None else new_actor(self.shape, config.noise)).to(device)
        context, past = context_in(env, self.ranks), past_in(env)
        sizes = (env.num_actions, past, context.shape[1])
        self._fit(world_model_needs(config, env.num_envs, self._groups(), *sizes))
        model = Dynamics(env.num_actions, config.model_hidden, env.dt, context.shape[1], past).to(device)
        self.memory = Memory(config.memory, context, env.num_actions, past)
        self.imagination = Imagination(env, config.horizon, config.compile)
        self.policy_update = PolicyUpdate(actor, model.frozen(), self.imagination, self.memory, config, self.ranks)
        self.model_update = ModelUpdate(model, self.memory, config, self.ranks)
        self._begin_value(origin)
        self._collect = Collector(env, self.memory, config.noise)
        self._frames_before = 0
        self._kept: int | None = None
        if self.ranks.count > 1:
            torch.manual_seed(self.ranks.seed(seed))  # the networks are alike everywhere, the noise is not
        self._resume()

    @property
    def frames(self) -> int:
        """Control steps seen so far, of all worlds."""
        return self._frames_before + self.memory.added * self.env.num_envs * self.ranks.count

    def _coming(self) -> int:
        fill = max(self.config.memory - self.memory.added - self.config.steps, 0)
        return super()._coming() + fill * self.env.num_envs * self.ranks.count

    def policy(self) -> Policy:
        """The average of the policy as it is now, with the value as PPO's critic; a copy."""
        actor = new_actor(self.shape)
        actor.load_state_dict(self.policy_update.average.state_dict())
        return Policy(actor, self.policy_update.critic.to_ppo(self._factor), self.shape)

    def accuracy(self) -> Accuracy:
        """Errors of the model as it is now on the held-out worlds; all ranks must ask."""
        return accuracy(self.model_update.model, self.memory, self.ranks)

    def state_dict(self) -> dict[str, Any]:
        """Networks, optimisers and counts, which are those of all ranks."""
        return {
            "model": self.model_update.state_dict(),
            "policy": self.policy_update.state_dict(),
            "iteration": self.iteration,
            "seconds": self._seconds,
            "frames": self.frames,
            "failure": self.env.sampler.failure.cpu(),
        }

    def load_state_dict(self, saved: dict[str, Any]) -> None:
        """Go on from what `state_dict` gave."""
        self.model_update.load_state_dict(saved["model"])
        self.policy_update.load_state_dict(saved["policy"])
        self.iteration, self._seconds = saved["iteration"], saved["seconds"]
        self._frames_before += saved["frames"] - self.frames
        self.env.sampler.failure.copy_(saved["failure"])
        self._kept = self.iteration

    def own_state(self) -> dict[str, Any]:
        """State that this rank alone goes on from: its worlds, its noise and its memory."""
        return super().own_state() | {"memory": self.memory.state_dict(), "collector": self._collect.state_dict()}

    def load_own_state(self, saved: dict[str, Any]) -> None:
        """Go on from what `own_state` gave, after `load_state_dict`."""
        frames = self.frames
        self.memory.load_state_dict(saved["memory"])
        self._collect.load_state_dict(saved["collector"])
        self._frames_before += frames - self.frames
        super().load_own_state(saved)

    def save_checkpoint(self) -> None:
        """Write all that the next iteration depends on, of all ranks, whole or not at all; all ranks must call it.

        Raises:
            BadInput: for a model that predicts no better than uniform motion; the checkpoint before it stands.
        """
        found = self.accuracy()
        if not found.loss <= found.still:
            came = f"a loss of {found.loss:.3g} after a control step, and {found.still:.3g} for uniform motion"
            raise self._diverged("a model that predicts better than uniform motion", came, "model_rate")
        super().save_checkpoint()
        self._kept = self.iteration
        if self.ranks.first:
            errors = CurveWriter(self.folder / ERRORS, self.iteration - 1)
            for name, value in found.by_horizon.items():
                errors.add_scalar(name, value, self.iteration)
            errors.stop()

    def _iterate(self) -> dict[str, float]:
        config, env = self.config, self.env
        env.progress = done = min(self.iteration / max(config.iterations, 1), 1.0)
        updates = (self.model_update, self.policy_update)
        for update in updates:
            update.decay(done)
        for _ in range(config.steps):
            seen = self._collect(self._act)
        self._look(seen)
        if not self.memory.full:
            while not self.memory.full:
                self._look(self._collect(self._act))
            if self.iteration == 0:
                self.model_update.begin()
        env.engine.check()
        self.ranks.add(env.statistics.sums)
        self.ranks.add(env.sampler.failure)
        env.sampler.failure.div_(self.ranks.count)
        for _ in range(config.model_updates):
            self.model_update()
        for _ in range(config.policy_updates):
            self.policy_update()
        told = {name: float(value) for update in updates for name, value in update.told.items()}
        told = self.ranks.mean(told, env.device)
        for name, value in told.items():
            if not math.isfinite(value):
                part = next((part for part in ("model", "value") if part in name), "policy")
                raise self._diverged("finite losses and gradients", f"{name} {value}", f"{part}_rate")
        rate = float(self.policy_update.descents["policy"].rate)
        return env.statistics.take() | told | {"learning_rate": rate, "threshold": env.threshold}

    @property
    def _factor(self) -> float:
        """How many times as high PPO's critic values a state: it adds up rewards, and the value is their mean."""
        return self.env.dt / (1 - self.config.gamma)

    def _begin_value(self, origin: Policy | None) -> None:
        """Let the value go on from the parent's critic, if that one saw what the critic sees here."""
        if (
            origin is not None
            and origin.critic_state
            and origin.shape.critic_observation == self.shape.critic_observation
        ):
            self.policy_update.value_from(origin.critic_state, self._factor)

    def _look(self, seen: TensorDict) -> None:
        """Let policy and value be normalised by what was seen too, unless what was collected is no numbers."""
        if (fault := self.memory.fault()) is not None:
            do = "Look for it in the motions and the robot's model."
            raise BadInput("what the simulator gave", "numbers", fault, do)
        self.policy_update.look(seen["policy"], seen["critic"])

    def _diverged(self, expected: str, came: str, setting: str) -> BadInput:
        """The line for a training that leads nowhere."""
        stands = "No checkpoint was written." if self._kept is None else f"The checkpoint of {self._kept} stands."
        came = f"{came}, at iteration {self.iteration}"
        return BadInput(f"training, {setting}", expected, came, f"{stands} Lower `{setting}`.")

    def _act(self, seen: Tensor) -> Tensor:
        """Actions (N, J) of the policy that learns, without exploration."""
        return self.policy_update.actor({"policy": seen})
