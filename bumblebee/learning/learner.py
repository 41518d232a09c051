"""One interface of what trains a tracking policy: the loop, curve, progress and checkpoints of every learner.

PPO (`ppo`) and the learner through a model of the robot (`world_model`) say how an iteration learns and what they know;
whoever trains by one of them knows this interface alone (`learners.make_learner`).
"""

import contextlib
import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any, ClassVar

import torch

from bumblebee.errors import BadInput
from bumblebee.learning.checkpoint import load_checkpoint, save_checkpoint
from bumblebee.learning.curve import CurveWriter
from bumblebee.learning.gpu_memory import Needs, told
from bumblebee.learning.policy import Policy, Shape, load_policy, shape_of
from bumblebee.learning.ranks import Ranks
from bumblebee.progress import SECONDS, pace, progress
from bumblebee.robot.facts import ROBOT
from bumblebee.sim.warp_limits import within_memory
from bumblebee.tracking.env import TrackingEnv

CHECKPOINT, CURVE = "checkpoint.pt", "curve.csv"
_SEEN = ("ahead", "terms", "history", "now", "action", "transformer", "observation", "actions")


class Learner(ABC):
    """Trains one policy in `env`, and can be killed at any time.

    Args:
        env: the task.
        config: the algorithm.
        folder: for the checkpoint and the curve; a checkpoint found there is continued.
        ranks: the processes that train this policy together, each with such a learner around its own worlds.
    """

    name: ClassVar[str]
    """Its name in settings and cards, and of its section of settings."""

    def __init__(self, env: TrackingEnv, config: Any, folder: Path, ranks: Ranks | None) -> None:
        self.env, self.config, self.folder, self.ranks = env, config, Path(folder), ranks or Ranks()
        self.iteration, self._seconds = 0, 0.0
        self.limit: float | None = None
        """Time of the whole training [s], where that ends it."""

    @property
    @abstractmethod
    def frames(self) -> int:
        """Control steps seen so far, of all worlds of all ranks."""

    @abstractmethod
    def policy(self) -> Policy:
        """The policy as it is now; a copy."""

    @abstractmethod
    def state_dict(self) -> dict[str, Any]:
        """State that all ranks share and go on from: networks, optimisers and counts."""

    @abstractmethod
    def load_state_dict(self, saved: dict[str, Any]) -> None:
        """Go on from what `state_dict` gave."""

    @abstractmethod
    def _iterate(self) -> dict[str, float]:
        """Learn for one iteration; its row of the curve, with `success` and `key_error` [m]."""

    def own_state(self) -> dict[str, Any]:
        """State that this rank alone goes on from: its worlds and its noise."""
        return {"env": self.env.state_dict(), "random": _random_state()}

    def load_own_state(self, saved: dict[str, Any]) -> None:
        """Go on from what `own_state` gave."""
        self.env.load_state_dict(saved["env"])
        _set_random_state(saved["random"])

    def train(self, what: str = "policy", enough: Callable[[], bool] = lambda: False) -> None:
        """Train up to the configured iterations, or until it is `enough`; a line of `curve.csv` each.

        `enough` may set `config` anew, whose iterations are the schedules' length: when to end is its answer alone.
        """
        last = self.config.iterations
        with self._told(what) as tell:
            while self.iteration < last and not self.ranks.decide(enough):
                began, before = time.monotonic(), self.frames
                with within_memory(self.env.num_envs):
                    scalars = self._iterate()
                self._seconds += time.monotonic() - began
                self.iteration += 1
                tell({"frames": self.frames, "seconds": self._seconds, **scalars}, self.frames - before)
                if self.iteration % self.config.checkpoint_every == 0:
                    self.save_checkpoint()

    def save_checkpoint(self) -> None:
        """Write all that the next iteration depends on, of all ranks, whole or not at all; all ranks must call it."""
        each = self.ranks.gather(self.own_state())
        if each is None:
            return
        self.folder.mkdir(parents=True, exist_ok=True)
        save_checkpoint(self.folder / CHECKPOINT, {"of": self._made_of(), "shared": self.state_dict(), "ranks": each})

    def _resume(self) -> None:
        """Go on from the folder's checkpoint, if there is one; for the end of a learner's construction.

        Raises:
            BadInput: if it is another learner's, another robot's, or of networks that are not these.
        """
        path = self.folder / CHECKPOINT
        if not path.exists():
            return
        content, do = load_checkpoint(path), "Remove it to train from the start."
        for name, wanted in self._made_of().items():
            if (came := content.get("of", {}).get(name)) != wanted:
                raise BadInput(f"{path}: {name}", f"{wanted!r}", f"{came!r}", do)
        each = content["ranks"]
        try:
            self.load_state_dict(content["shared"])
            if len(each) == self.ranks.count:
                self.load_own_state(each[self.ranks.rank])
        except (KeyError, RuntimeError, ValueError) as error:  # as torch says that sizes or names differ
            raise BadInput(path, "a checkpoint of these settings", str(error), do) from None
        if len(each) != self.ranks.count and self.ranks.first:
            print(f"{path}: of {len(each)} GPUs, goes on with {self.ranks.count} and new episodes", flush=True)

    def _made_of(self) -> dict[str, Any]:
        """Identity of a checkpoint as plain values: the learner, the robot, and what its policy sees and gives."""
        shape = {name: _plain(value) for name, value in asdict(shape_of(self.env, self.config.hidden)).items()}
        return {"learner": self.name, "robot": ROBOT, **shape}

    def _fit(self, needs: Needs) -> None:
        """Say what the training needs of a GPU, on the first rank; a line for one that is too small."""
        told(needs, self.env.num_envs, torch.device(self.env.device), self.ranks.first)

    def _groups(self) -> dict[str, int]:
        """Sizes of the observations by group."""
        return {name: seen.shape[1] for name, seen in self.env.get_observations().items()}

    def _coming(self) -> int:
        """Control steps of all worlds of all ranks until the last iteration is done."""
        left = max(self.config.iterations - self.iteration, 0)
        return left * self.config.steps * self.env.num_envs * self.ranks.count

    @contextlib.contextmanager
    def _told(self, what: str) -> Iterator[Callable[[dict[str, float], int], None]]:
        """Give a function that writes an iteration's row to the curve and counts frames; on the first rank alone."""
        if not self.ranks.first:
            yield lambda row, frames: None
            return
        curve = CurveWriter(self.folder / CURVE, self.iteration)
        work = (self.frames + self._coming(), "frames", self.frames)
        total, unit, start = work if self.limit is None else (self.limit, SECONDS, self._seconds)
        with progress(total, f"train {what}", unit, start) as bar:

            def tell(row: dict[str, float], frames: int) -> None:
                for name, value in row.items():
                    curve.add_scalar(name, value, self.iteration)
                curve.flush()
                known = f"success {row['success']:.2f}, " if math.isfinite(row["success"]) else ""
                note = f"{known}key error {row['key_error']:.3f} m"
                if self.limit is None:
                    bar.total = self.frames + self._coming()  # `enough` may have set other iterations
                    bar.update(frames, note)
                else:
                    took = row["seconds"] - bar.done
                    bar.update(took, f"{pace(frames / took, 'frames')}, {note}")

            yield tell
        curve.stop()


def parent_policy(folder: Path, env: TrackingEnv) -> Policy:
    """The policy of a folder, to train on in `env`.

    Raises:
        BadInput: if it sees something else than `env` shows, or means something else by its action.
    """
    found = load_policy(folder)
    here: Shape = shape_of(env, found.shape.hidden)
    for field in _SEEN:
        wanted, came = getattr(here, field), getattr(found.shape, field)
        if wanted != came:
            raise BadInput(f"{folder}: {field}", f"{wanted} as in `env`", str(came), "Start from another policy.")
    return found


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _random_state() -> dict[str, torch.Tensor]:
    """The state of torch's own generators."""
    state = {"cpu": torch.get_rng_state()}
    return state | {"cuda": torch.cuda.get_rng_state()} if torch.cuda.is_available() else state


def _set_random_state(state: dict[str, torch.Tensor]) -> None:
    torch.set_rng_state(state["cpu"])
    if "cuda" in state and torch.cuda.is_available():
        torch.cuda.set_rng_state(state["cuda"])
