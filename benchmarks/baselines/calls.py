"""Trainings over several calls: when each ends, what is kept between them, and lines now and then."""

import time
from pathlib import Path

import torch

from benchmarks.baselines.others.env import BaselineEnv
from bumblebee.files import save_tensors
from bumblebee.learning.learner import Learner
from bumblebee.learning.policy import Policy
from bumblebee.learning.ppo.learner import Trainer


class Clock:
    """When to stop: the call's end, and lines now and then.

    Args:
        minutes: how long this call may train; None for as long as it takes.
    """

    def __init__(self, minutes: float | None) -> None:
        self.began = time.monotonic()
        self.limit = None if minutes is None else 60 * minutes
        self._marks = {"tell": self.began, "save": self.began}

    @property
    def over(self) -> bool:
        """Whether the call's time is up."""
        return self.limit is not None and time.monotonic() - self.began > self.limit

    def due(self, what: str, every: float) -> bool:
        """Whether so many seconds have gone by since this was last due."""
        if time.monotonic() - self._marks[what] < every:
            return False
        self._marks[what] = time.monotonic()
        return True


def keep_actor(trainer: Learner, out: Path, every: float) -> None:
    """Keep the actor as it is after each `every` seconds of training, as `at-<seconds>s` in `out`; 0: never."""
    if every and (mark := trainer._seconds // every):
        folder = out / f"at-{mark * every:g}s"
        if not folder.exists():
            folder.mkdir()
            policy = trainer.policy()
            Policy(policy.actor, {}, policy.shape).save(folder)


def save(trainer: Trainer, path: Path) -> None:
    """Write what `resume` goes on from."""
    env = trainer.env
    score = env.score.kept() if isinstance(env, BaselineEnv) else {}
    content = {
        "algorithm": trainer.algorithm.save(),
        "learning_rate": trainer.algorithm.learning_rate,
        "iteration": trainer.iteration,
        "seconds": trainer._seconds,
        "failure": env.sampler.failure.cpu(),
        "score": {name: score[name].cpu() for name in ("factor", "mean_length") if score},
    }
    save_tensors(path, content)


def resume(trainer: Trainer, path: Path) -> None:
    """Go on from what `save` wrote."""
    content = torch.load(path, weights_only=True, map_location="cpu")
    trainer.algorithm.load(content["algorithm"], None, True)
    trainer.algorithm.learning_rate = content["learning_rate"]
    trainer.iteration, trainer._seconds = content["iteration"], content["seconds"]
    trainer.env.sampler.failure.copy_(content["failure"])
    if isinstance(trainer.env, BaselineEnv):
        for name, value in content["score"].items():
            trainer.env.score.kept()[name].copy_(value)
    print(f"goes on after {trainer.iteration} iterations, {trainer._seconds / 60:.1f} min", flush=True)


def tell(curve: Path) -> None:
    """Print the last row of a learning curve."""
    if curve.exists():
        lines = curve.read_text().splitlines()
        names, values = lines[0].split(","), lines[-1].split(",")
        row = dict(zip(names, values, strict=False))
        wanted = ("frames", "seconds", "reward", "success", "key_error", "episode_length", "unstable", "action_std")
        wanted += ("loss_model", "imagined", "alive")
        print(
            "  ".join(f"{name} {row[name]}" for name in (*wanted, "learning_rate", "threshold") if name in row),
            flush=True,
        )
