"""The world-model learner around the tracking environment: collect, fit the model, improve the policy through it."""

import math
import time
from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.learning.checkpoint import load_checkpoint, save_checkpoint
from bumblebee.learning.curve import CurveWriter
from bumblebee.learning.policy import Policy, load_policy, new_actor, shape_of
from bumblebee.learning.update_graph import Recorded
from bumblebee.learning.world_model.body import packed
from bumblebee.learning.world_model.config import WorldModelConfig
from bumblebee.learning.world_model.context import context_of
from bumblebee.learning.world_model.dynamics import Dynamics
from bumblebee.learning.world_model.imagination import Imagination
from bumblebee.learning.world_model.memory import Memory
from bumblebee.progress import progress
from bumblebee.sim.warp_limits import within_memory
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.randomisation import draw_fields
from bumblebee.tracking.terms import see

CHECKPOINT, CURVE = "checkpoint.pt", "curve.csv"
_LOWEST = 0.1  # of a learning rate, at the end of its cosine


class WorldModelTrainer:
    """Trains one policy in `env` through a model of it, and can be killed at any time.

    Args:
        env: the task; its policy sees no history.
        config: the algorithm.
        folder: for the checkpoint and the curve; a checkpoint found there is continued.
        seed: of the networks and of the exploration.
        parent: folder of a policy to start from, if any; a child has its parent's layers, whatever `config` says.

    Raises:
        BadInput: for a task whose policy sees a history, or a parent of another shape.
    """

    def __init__(
        self,
        env: TrackingEnv,
        config: WorldModelConfig,
        folder: Path,
        seed: int = 0,
        parent: Path | None = None,
    ) -> None:
        if env.cfg.observation.history > 1:
            came = f"{env.cfg.observation.history} steps"
            raise BadInput("env.observation.history", "1 for the learner world_model", came, "Set learner: ppo.")
        origin = None if parent is None else load_policy(parent)
        if origin is not None:
            config = replace(config, hidden=origin.shape.hidden)
        self.env, self.config, self.folder = env, config, Path(folder)
        torch.manual_seed(seed)
        device = self._device = torch.device(env.device)
        if device.type == "cuda":
            torch.set_float32_matmul_precision("high")
        self.shape = shape_of(env, config.hidden)
        if origin is not None and replace(origin.shape, critic_observation=0) != replace(
            self.shape, critic_observation=0
        ):
            raise BadInput(parent, f"a policy of the shape {self.shape}", str(origin.shape), "Start from another one.")
        self.actor = (origin.actor if origin is not None else new_actor(self.shape)).to(device)
        self._normalised = origin is not None
        drawn = draw_fields(env.engine.model, env.cfg.randomisation, env.num_envs, env.seed)
        context = torch.tensor(context_of(env.engine.model, drawn, env.num_envs), dtype=torch.float32, device=device)
        self.model = Dynamics(env.num_actions, config.model_hidden, env.dt, context.shape[1]).to(device)
        if config.compile:
            self.model.step = torch.compile(self.model.step, dynamic=False)
        self.memory = Memory(config.memory, context, env.num_actions)
        self.imagination = Imagination(env, config.horizon, config.gamma, config.compile)
        self.average = deepcopy(self.actor).requires_grad_(False)
        self._rates = {"model": torch.tensor(config.model_rate), "policy": torch.tensor(config.policy_rate)}
        self._rates = {name: rate.to(device) for name, rate in self._rates.items()}
        on_gpu = device.type == "cuda"
        self._trained = [p for n, p in self.actor.named_parameters() if n.startswith("mlp")]
        self._optimizers = {
            name: torch.optim.Adam(weights, lr=self._rates[name], fused=True, capturable=on_gpu)
            for name, weights in (("model", list(self.model.parameters())), ("policy", self._trained))
        }
        self._told = {name: torch.zeros((), device=device) for name in ("model", "imagined", "alive")}
        self._update_model = Recorded(self._model_step, device, lambda: [])
        self._update_policy = Recorded(self._policy_step, device, lambda: [])
        self._noise = config.noise * torch.linspace(0, 2, env.num_envs, device=device)[:, None]
        self._earlier, self._last = (torch.zeros(env.num_envs, env.num_actions, device=device) for _ in range(2))
        self._before = self._held()
        self.iteration, self._seconds = 0, 0.0
        self._resume()

    @property
    def frames(self) -> int:
        """Control steps seen so far, of all worlds."""
        return self.memory.added * self.env.num_envs

    def train(self, what: str = "policy", enough: Callable[[], bool] = lambda: False) -> None:
        """Train up to the configured iterations, or until it is `enough`; a line of `curve.csv` each."""
        curve = CurveWriter(self.folder / CURVE, self.iteration)
        with progress(self.config.iterations, f"train {what}", "iterations", start=self.iteration) as bar:
            while self.iteration < self.config.iterations and not enough():
                began = time.monotonic()
                with within_memory(self.env.num_envs):
                    scalars = self._iterate()
                self._seconds += time.monotonic() - began
                self.iteration += 1
                row = {"frames": self.frames, "seconds": self._seconds, **scalars}
                for name, value in row.items():
                    curve.add_scalar(name, value, self.iteration)
                curve.flush()
                bar.update(1, f"success {row['success']:.2f}, key error {row['key_error']:.3f} m")
                if self.iteration % self.config.checkpoint_every == 0:
                    self.save_checkpoint()
        curve.stop()

    def policy(self) -> Policy:
        """The average of the policy as it is now; a copy."""
        actor = new_actor(self.shape)
        actor.load_state_dict(self.average.state_dict())
        return Policy(actor, {}, self.shape)

    def state_dict(self) -> dict[str, Any]:
        """Networks, optimisers and counts: what a training goes on from, with new episodes."""
        return {
            "actor": self.actor.state_dict(),
            "average": self.average.state_dict(),
            "model": self.model.state_dict(),
            "optimizers": {name: optimizer.state_dict() for name, optimizer in self._optimizers.items()},
            "iteration": self.iteration,
            "seconds": self._seconds,
            "added": self.memory.added,
            "failure": self.env.sampler.failure.cpu(),
        }

    def load_state_dict(self, saved: dict[str, Any]) -> None:
        """Go on from what `state_dict` gave."""
        self.actor.load_state_dict(saved["actor"])
        self.average.load_state_dict(saved["average"])
        self.model.load_state_dict(saved["model"])
        for name, optimizer in self._optimizers.items():
            optimizer.load_state_dict(saved["optimizers"][name])
            for group in optimizer.param_groups:
                group["lr"] = self._rates[name]
        self.iteration, self._seconds = saved["iteration"], saved["seconds"]
        self.env.sampler.failure.copy_(saved["failure"])
        self._normalised = True

    def save_checkpoint(self) -> None:
        """Write networks, optimisers and counts, whole or not at all."""
        self.folder.mkdir(parents=True, exist_ok=True)
        save_checkpoint(self.folder / CHECKPOINT, self.state_dict())

    def _resume(self) -> None:
        if (self.folder / CHECKPOINT).exists():
            self.load_state_dict(load_checkpoint(self.folder / CHECKPOINT))

    def _iterate(self) -> dict[str, float]:
        config, env = self.config, self.env
        done = min(self.iteration / max(config.iterations, 1), 1.0)
        env.progress = done
        for name, first in (("model", config.model_rate), ("policy", config.policy_rate)):
            self._rates[name].fill_(first * (_LOWEST + (1 - _LOWEST) * 0.5 * (1 + math.cos(math.pi * done))))
        with torch.no_grad():
            for _ in range(config.steps):
                self._collect()
        if not self.memory.full:
            with torch.no_grad():
                while not self.memory.full:
                    self._collect()
            self._first_look()
        env.engine.check()
        for _ in range(config.model_updates):
            self._update_model()
        for _ in range(config.policy_updates):
            self._update_policy()
        told = {f"loss_{name}" if name == "model" else name: float(value) for name, value in self._told.items()}
        if not math.isfinite(told["loss_model"]):
            raise FloatingPointError(f"the world model's loss is no number at iteration {self.iteration}")
        return (
            env.statistics.take() | told | {"learning_rate": float(self._rates["policy"]), "threshold": env.threshold}
        )

    def _collect(self) -> None:
        """One control step of all worlds with the policy and its exploration, into the memory."""
        env = self.env
        shown = env.get_observations()["policy"]
        action = self.actor({"policy": shown}) + self._noise * torch.randn_like(self._last)
        state, ref = env.now
        body, target = packed(state), self.imagination.targets(ref, action)
        self.memory.begin(
            env.clip, env.frame, body=body, target=target, before=self._before, action=self._last, earlier=self._earlier
        )
        _, _, done, _ = env.step(action)
        self.memory.end(done)
        fresh = done[:, None]
        self._before = torch.where(fresh, self._held(), target)
        self._earlier = self._last.masked_fill(fresh, 0.0)
        self._last = action.masked_fill(fresh, 0.0)

    def _held(self) -> Tensor:
        """Targets (N, J) [rad] that a robot's servos are held at when its episode begins in this frame."""
        return self.env.library.frames(self.env.clip, self.env.frame * self.env.dt).hold_pos

    def _first_look(self) -> None:
        """Normalise both networks by the first full memory, and let the model learn alone for a while."""
        if not self._normalised:
            window = self.memory.windows(1, 65_536)
            self.model.normalise(window.bodies[0], window.targets[0], window.before, window.context, window.bodies[1])
            starts = self.memory.starts(65_536)
            with torch.no_grad():
                state, _ = self.imagination.state(starts.body)
                ref = self.imagination.references(starts.clip, starts.frame)[0]
                seen = see(self.imagination.terms, state, ref, starts.action)
                for actor in (self.actor, self.average):
                    actor.train()
                    actor.obs_normalizer.update(seen)
                    actor.eval()
            self._normalised = True
        for _ in range(self.config.warm_up):
            self._update_model()

    def _model_step(self) -> None:
        window = self.memory.windows(self.config.window, self.config.model_batch)
        predicted = self.model.unrolled(window.bodies[0], window.targets, window.before, window.context)
        loss = self.model.loss(predicted, window.bodies[1:], window.valid)
        self._descend("model", loss, list(self.model.parameters()))
        self._told["model"].copy_(loss.detach())

    def _policy_step(self) -> None:
        starts = self.memory.starts(self.config.policy_batch)
        earned, alive = self.imagination.returns(self._act, self.model, starts)
        self._descend("policy", -earned.mean() / self.config.horizon, self._trained)
        for own, kept in zip(self._trained, self._averaged(), strict=True):
            kept.lerp_(own.detach(), 1 - self.config.average)
        self._told["imagined"].copy_(earned.detach().mean() / self.config.horizon)
        self._told["alive"].copy_(alive.mean())

    def _act(self, seen: Tensor) -> Tensor:
        """Mean actions (B, J) of the policy that learns."""
        return self.actor({"policy": seen})

    def _averaged(self) -> Iterator[Tensor]:
        return (p.data for n, p in self.average.named_parameters() if n.startswith("mlp"))

    def _descend(self, name: str, loss: Tensor, weights: list[Tensor]) -> None:
        optimizer = self._optimizers[name]
        optimizer.zero_grad(set_to_none=False)
        for weight, gradient in zip(weights, torch.autograd.grad(loss, weights), strict=True):
            weight.grad = gradient if weight.grad is None else weight.grad.copy_(gradient)
        torch.nn.utils.clip_grad_norm_(weights, self.config.grad_norm)
        optimizer.step()
