"""PPO of rsl_rl around the tracking environment: our loop, curve, curriculum and checkpoints (paper, section 3.2).

rsl_rl's own `learn` prints a screen an iteration and forgets the environment in its checkpoints; the steps between are
its, unchanged, or its update is recorded (`update`).
"""

import contextlib
import io
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from bumblebee.errors import BadInput
from bumblebee.learning.bounded_ppo import BoundedPpo
from bumblebee.learning.checkpoint import load_checkpoint, save_checkpoint
from bumblebee.learning.config import PpoConfig
from bumblebee.learning.curve import CurveWriter
from bumblebee.learning.policy import Policy, load_policy, model_config, new_actor, shape_of
from bumblebee.learning.ranks import Ranks
from bumblebee.progress import progress
from bumblebee.sim.warp_limits import within_memory
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.mirror import augmentation

CHECKPOINT, CURVE = "checkpoint.pt", "curve.csv"


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


class Trainer:
    """Trains one policy in `env`, and can be killed at any time.

    Args:
        env: the task.
        config: the algorithm.
        folder: for the checkpoint and the curve; a checkpoint found there is continued.
        seed: of the network and of the actions' noise.
        parent: folder of a policy to start from, if any; a child has its parent's layers, whatever `config` says.
        ranks: the processes that train this policy together, each with such a trainer around its own worlds.
    """

    def __init__(
        self,
        env: TrackingEnv,
        config: PpoConfig,
        folder: Path,
        seed: int = 0,
        parent: Path | None = None,
        ranks: Ranks | None = None,
    ) -> None:
        origin = None if parent is None else load_policy(parent)
        if origin is not None:
            config = replace(config, hidden=origin.shape.hidden)
        self.env, self.config, self.folder, self.ranks = env, config, Path(folder), ranks or Ranks()
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
        self.iteration, self._seconds = 0, 0.0
        if origin is not None:
            self._start_from(origin, str(parent))
        if self.ranks.count > 1:
            self.algorithm.broadcast_parameters()
            torch.manual_seed(self.ranks.seed(seed))  # the networks are alike everywhere, the noise is not
        self._resume()

    @property
    def frames(self) -> int:
        """Control steps seen so far, of all worlds of all ranks."""
        return self.iteration * self._frames_an_iteration

    @property
    def _frames_an_iteration(self) -> int:
        return self.config.steps * self.env.num_envs * self.ranks.count

    def train(self, what: str = "policy", enough: Callable[[], bool] = lambda: False) -> None:
        """Train up to the configured iterations, or until it is `enough`; a line of `curve.csv` each."""
        config, per_iteration = self.config, self._frames_an_iteration
        self.algorithm.train_mode()
        with self._told(what) as tell:
            while self.iteration < config.iterations and not self.ranks.decide(enough):
                began = time.monotonic()
                with within_memory(self.env.num_envs):
                    scalars = self._iterate()
                self._seconds += time.monotonic() - began
                self.iteration += 1
                tell({"frames": self.frames, "seconds": self._seconds, **scalars}, per_iteration)
                if self.iteration % config.checkpoint_every == 0:
                    self.save_checkpoint()

    @contextlib.contextmanager
    def _told(self, what: str) -> Iterator[Callable[[dict[str, float], int], None]]:
        """What writes an iteration's row to the curve and counts its frames; on the first rank alone."""
        if not self.ranks.first:
            yield lambda row, frames: None
            return
        curve = CurveWriter(self.folder / CURVE, self.iteration)
        total = self.config.iterations * self._frames_an_iteration
        with progress(total, f"train {what}", "frames", start=self.frames) as bar:

            def tell(row: dict[str, float], frames: int) -> None:
                for name, value in row.items():
                    curve.add_scalar(name, value, self.iteration)
                curve.flush()
                bar.update(frames, f"success {row['success']:.2f}, key error {row['key_error']:.3f} m")

            yield tell
        curve.stop()

    def policy(self) -> Policy:
        """The policy as it is now; a copy."""
        shape = shape_of(self.env, self.config.hidden)
        actor = new_actor(shape)
        actor.load_state_dict(self.algorithm.actor.state_dict())
        critic = {name: tensor.cpu().clone() for name, tensor in self.algorithm.critic.state_dict().items()}
        return Policy(actor, critic, shape)

    def save_checkpoint(self) -> None:
        """Write all that the next iteration depends on, of all ranks, whole or not at all; all ranks must call it."""
        each = self.ranks.gather({"env": self.env.state_dict(), "random": _random_state()})
        if each is None:
            return
        self.folder.mkdir(parents=True, exist_ok=True)
        content = {
            "algorithm": self.algorithm.save(),
            "learning_rate": self.algorithm.learning_rate,
            "iteration": self.iteration,
            "seconds": self._seconds,
            "ranks": each,
        }
        save_checkpoint(self.folder / CHECKPOINT, content)

    def _resume(self) -> None:
        path = self.folder / CHECKPOINT
        if not path.exists():
            return
        content = load_checkpoint(path)
        self.algorithm.load(content["algorithm"], None, True)
        self.algorithm.learning_rate = content["learning_rate"]
        self.iteration, self._seconds = content["iteration"], content["seconds"]
        each = content["ranks"]
        if len(each) == self.ranks.count:
            self.env.load_state_dict(each[self.ranks.rank]["env"])
            _set_random_state(each[self.ranks.rank]["random"])
        elif self.ranks.first:
            print(f"{path}: of {len(each)} GPUs, goes on with {self.ranks.count} and new episodes", flush=True)

    def _start_from(self, parent: Policy, name: str) -> None:
        here, there = shape_of(self.env, self.config.hidden), parent.shape
        for field in ("ahead", "terms", "history", "now", "action", "observation", "critic_observation"):
            wanted, came = getattr(here, field), getattr(there, field)
            if wanted != came:
                raise BadInput(f"{name}: {field}", f"{wanted} as in `env`", str(came), "Start from another policy.")
        if not parent.critic_state:
            wanted = "a policy with its critic, as PPO leaves it"
            raise BadInput(f"{name}: critic", wanted, "none", "Start from another policy.")
        self.algorithm.actor.load_state_dict(parent.actor.state_dict())
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
        losses = algorithm.update()
        self.ranks.add(env.statistics.sums)
        losses = self.ranks.mean({name: float(value) for name, value in losses.items()}, env.device)
        scalars = env.statistics.take() | {f"loss_{name}": value for name, value in losses.items()}
        scalars |= {"learning_rate": algorithm.learning_rate, "action_std": std, "threshold": env.threshold}
        if not np.isfinite(scalars["loss_value"]):
            raise FloatingPointError(f"the critic's loss is no number at iteration {self.iteration}")
        return scalars


def _random_state() -> dict[str, torch.Tensor]:
    """The state of torch's own generators."""
    state = {"cpu": torch.get_rng_state()}
    return state | {"cuda": torch.cuda.get_rng_state()} if torch.cuda.is_available() else state


def _set_random_state(state: dict[str, torch.Tensor]) -> None:
    torch.set_rng_state(state["cpu"])
    if "cuda" in state and torch.cuda.is_available():
        torch.cuda.set_rng_state(state["cuda"])
