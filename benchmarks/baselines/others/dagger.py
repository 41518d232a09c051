"""DAgger from one privileged teacher to a student: the student acts, the teacher says what it would have done there.

Every update learns from the steps just taken and from nothing older, as the public code of OmniH2O and HOVER does.
"""

import time
from collections.abc import Callable
from pathlib import Path

import torch
from torch import Tensor

from benchmarks.baselines.others.spec import StudentConfig
from bumblebee.files import save_tensors
from bumblebee.learning.curve import CurveWriter
from bumblebee.learning.policy import Policy, new_actor, shape_of
from bumblebee.tracking.env import TrackingEnv

CHECKPOINT, CURVE = "student.pt", "student.csv"


def action_loss(kind: str, student: Tensor, teacher: Tensor) -> Tensor:
    """How far actions (B, J) are from the teacher's: mean norm of the difference, or its mean square."""
    away = student - teacher
    return away.norm(dim=-1).mean() if kind == "norm" else away.square().mean()


class Distiller:
    """Distils one student in `env`, and can be killed at any time; episodes begin anew when it goes on.

    Args:
        env: the task, with a group "student".
        teacher: sees the group "policy", exact.
        config: the algorithm.
        folder: for the checkpoint and the curve; a checkpoint found there is continued.
        seed: of the network.
    """

    def __init__(self, env: TrackingEnv, teacher: Policy, config: StudentConfig, folder: Path, seed: int = 0) -> None:
        self.env, self.config, self.folder = env, config, Path(folder)
        self.teacher = teacher.actor.to(env.device)
        torch.manual_seed(seed)
        self.shape = shape_of(env, config.hidden, "student")
        self.actor = new_actor(self.shape).to(env.device)
        self.optimiser = torch.optim.Adam(self.actor.parameters(), lr=config.learning_rate)
        self.iteration, self.seconds = 0, 0.0
        self._resume()

    @property
    def frames(self) -> int:
        """Control steps seen so far, of all worlds."""
        return self.iteration * self.config.steps * self.env.num_envs

    def train(self, enough: Callable[[], bool], every: int = 50) -> None:
        """Distil until it is `enough`, which is asked after each update; a line of the curve every `every` updates."""
        curve = CurveWriter(self.folder / CURVE, self.iteration)
        self.env.progress = 1.0
        total = torch.zeros((), device=self.env.device)
        while not enough():
            began = time.monotonic()
            total += self._learn(*self._collect())
            self.iteration += 1
            self.seconds += time.monotonic() - began
            if self.iteration % every == 0:
                row = {"frames": float(self.frames), "seconds": self.seconds, "loss": float(total) / every}
                for name, value in (row | self.env.statistics.take()).items():
                    curve.add_scalar(name, value, self.iteration)
                curve.flush()
                self.env.engine.check()
                total.zero_()
        curve.stop()

    def policy(self) -> Policy:
        """The student as it is now; a copy, without a critic."""
        actor = new_actor(self.shape)
        actor.load_state_dict(self.actor.state_dict())
        return Policy(actor, {}, self.shape)

    def save_checkpoint(self) -> None:
        """Write network, optimiser and what the sampler knows."""
        self.folder.mkdir(parents=True, exist_ok=True)
        content = {
            "actor": self.actor.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "iteration": self.iteration,
            "seconds": self.seconds,
            "failure": self.env.sampler.failure.cpu(),
        }
        save_tensors(self.folder / CHECKPOINT, content)

    def _resume(self) -> None:
        path = self.folder / CHECKPOINT
        if not path.exists():
            return
        content = torch.load(path, weights_only=True, map_location="cpu")
        self.actor.load_state_dict(content["actor"])
        self.optimiser.load_state_dict(content["optimiser"])
        self.iteration, self.seconds = content["iteration"], content["seconds"]
        self.env.sampler.failure.copy_(content["failure"])

    @torch.no_grad()
    def _collect(self) -> tuple[Tensor, Tensor]:
        """Observations (N, D) of the student's own steps and what the teacher would have done there (N, J)."""
        seen, wanted = [], []
        for _ in range(self.config.steps):
            groups = self.env.get_observations()
            seen.append(groups["student"])
            wanted.append(self.teacher({"policy": groups["policy"]}))
            self.actor.obs_normalizer.update(groups["student"])
            self.env.step(self.actor({"policy": groups["student"]}))
        return torch.cat(seen), torch.cat(wanted)

    def _learn(self, seen: Tensor, wanted: Tensor) -> Tensor:
        """Mean loss () of the passes over what was collected."""
        config, total = self.config, torch.zeros((), device=seen.device)
        for _ in range(config.epochs):
            order = torch.randperm(len(seen), device=seen.device)
            for part in order.chunk(config.mini_batches):
                loss = action_loss(config.loss, self.actor({"policy": seen[part]}), wanted[part])
                self.optimiser.zero_grad()
                loss.backward()
                torch.nn.utils.clip_grad_norm_(self.actor.parameters(), config.grad_norm)
                self.optimiser.step()
                total += loss.detach()
        return total / (config.epochs * config.mini_batches)
