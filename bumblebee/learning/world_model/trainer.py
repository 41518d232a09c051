"""The world-model learner around the tracking environment: collect, fit the model, improve the policy through it."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.learning.learner import Learner, parent_policy
from bumblebee.learning.policy import Policy, new_actor, shape_of
from bumblebee.learning.ranks import Ranks
from bumblebee.learning.world_model.collector import Collector
from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.learning.world_model.context import context_of
from bumblebee.learning.world_model.dynamics import Dynamics, past_targets
from bumblebee.learning.world_model.imagination import Imagination
from bumblebee.learning.world_model.memory import Memory
from bumblebee.learning.world_model.model_update import ModelUpdate
from bumblebee.learning.world_model.policy_update import PolicyUpdate
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.randomisation import draw_fields


class WorldModelTrainer(Learner):
    """Trains one policy in `env` through a model of it.

    Args:
        env: the task; its policy sees no history.
        config: the algorithm.
        folder: for the checkpoint and the curve; a checkpoint found there is continued.
        seed: of the networks and of the exploration.
        parent: folder of a policy to start from, if any; a child has its parent's layers, whatever `config` says.
        ranks: the processes that train this policy together.

    Raises:
        BadInput: for a task or motions that it cannot learn from, or a parent of another shape.
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
        actor = (origin.actor if origin is not None else new_actor(self.shape)).to(device)
        drawn = draw_fields(env.engine.model, env.cfg.randomisation, env.num_envs, env.seed)
        context = torch.tensor(context_of(env.engine.model, drawn, env.num_envs), dtype=torch.float32, device=device)
        delay = float(env.engine.model.actuator_delay.max()) + env.cfg.randomisation.delay[1]
        past = past_targets(delay, env.dt)
        model = Dynamics(env.num_actions, config.model_hidden, env.dt, context.shape[1], past).to(device)
        self.memory = Memory(config.memory, context, env.num_actions, past)
        self.imagination = Imagination(env, config.horizon, config.compile)
        self.policy_update = PolicyUpdate(actor, model.frozen(), self.imagination, self.memory, config)
        self.model_update = ModelUpdate(model, self.memory, config)
        self._collect = Collector(env, self.memory, config.noise)
        self._frames_before = 0
        self._resume()

    @property
    def frames(self) -> int:
        """Control steps seen so far, of all worlds."""
        return self._frames_before + self.memory.added * self.env.num_envs

    def _coming(self) -> int:
        fill = max(self.config.memory - self.memory.added - self.config.steps, 0)
        return super()._coming() + fill * self.env.num_envs

    def policy(self) -> Policy:
        """The average of the policy as it is now; a copy."""
        actor = new_actor(self.shape)
        actor.load_state_dict(self.policy_update.average.state_dict())
        return Policy(actor, {}, self.shape)

    def state_dict(self) -> dict[str, Any]:
        """Networks, optimisers and counts: what a training goes on from, with new episodes."""
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
        self.iteration, self._seconds, self._frames_before = (saved[n] for n in ("iteration", "seconds", "frames"))
        self.env.sampler.failure.copy_(saved["failure"])

    def own_state(self) -> dict[str, Any]:
        """Nothing yet: new episodes fill the memory of a training that goes on."""
        return {}

    def load_own_state(self, saved: dict[str, Any]) -> None:
        """Nothing yet."""

    def _iterate(self) -> dict[str, float]:
        config, env = self.config, self.env
        done = min(self.iteration / max(config.iterations, 1), 1.0)
        env.progress = done
        updates = (self.model_update, self.policy_update)
        for update in updates:
            update.decay(done)
        for _ in range(config.steps):
            seen = self._collect(self._act)
        self.policy_update.look(seen)
        if not self.memory.full:
            while not self.memory.full:
                self.policy_update.look(self._collect(self._act))
            if self.iteration == 0:
                self.model_update.begin()
        env.engine.check()
        for _ in range(config.model_updates):
            self.model_update()
        for _ in range(config.policy_updates):
            self.policy_update()
        told = {name: float(value) for update in updates for name, value in update.told.items()}
        for name, value in told.items():
            if not math.isfinite(value):
                raise FloatingPointError(
                    f"the world model's training: {name} is no number at iteration {self.iteration}"
                )
        rate = float(self.policy_update.descents["policy"].rate)
        return env.statistics.take() | told | {"learning_rate": rate, "threshold": env.threshold}

    def _act(self, seen: Tensor) -> Tensor:
        """Actions (N, J) of the policy that learns, without exploration."""
        return self.policy_update.actor({"policy": seen})
