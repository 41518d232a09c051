"""DAgger from all experts into one generalist (paper, section 3.4 and the table "Hyperparameters for DAgger").

The generalist acts, the expert of each motion's cluster says what it would have done there, and the generalist learns
from everything gathered so far by KL(general || expert). Clusters have equal shares (appendix D: "each category is
equally represented"): of the draws of episodes, whatever fails, by the environment's `clip_share`, `ClipShares.equal`,
and of the loss, by weights, since episodes of short motions leave fewer samples.

A teacher and its student are the same with one expert and two observations: in an environment with a group "student",
the experts answer what they see in "policy", and who learns sees "student". Who learns may have a memory
(`transformer.py`): it is moved on while the student acts, and made anew of a sample's past when that is learnt from.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pandas as pd
import torch
from torch import Tensor

from bumblebee.errors import BadInput
from bumblebee.learning.checkpoint import load_checkpoint, save_checkpoint
from bumblebee.learning.gaussian import believed, gaussian, gaussian_kl
from bumblebee.learning.generalist.aggregate import Aggregate
from bumblebee.learning.generalist.config import PAPER_DAGGER, DistillConfig
from bumblebee.learning.generalist.student import group_of, new_student
from bumblebee.learning.policy import Policy, new_actor
from bumblebee.sim.warp_limits import within_memory
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.rows import Rows

__all__ = ["CHECKPOINT", "PAPER_DAGGER", "DistillConfig", "Distiller", "check_experts", "distill"]

CHECKPOINT = "distill.pt"


def distill(
    env: TrackingEnv,
    experts: Mapping[int, Policy],
    cluster: Sequence[int],
    config: DistillConfig,
    base: Policy | None = None,
    report: Callable[[int, str], None] = lambda frames, note: None,
    enough: Callable[[], bool] = lambda: False,
) -> tuple[Policy, pd.DataFrame]:
    """Distil in one go; the generalist, and its curve. `Distiller` says what is given, and goes on after a kill."""
    distiller = Distiller(env, experts, cluster, config, base)
    distiller.train(report, enough)
    return distiller.policy(), distiller.curve()


class Distiller:
    """Distils the experts into one policy, and can be killed at any time.

    A checkpoint has the network, the optimiser and the draws. The samples are gathered anew after a kill, by a student
    that is as good as before it, and episodes begin anew.

    Args:
        env: follows the training clips of all clusters.
        experts: cluster index -> its expert.
        cluster: (N,) cluster index of each clip of `env.library`.
        config: see `DistillConfig`.
        base: gives the start (`init: base`) and the sizes; nothing for a student with an observation of its own.
        folder: for the checkpoint; one found there is continued. Without it none is written.

    Raises:
        BadInput: an expert is missing or has a memory, the samples do not fit the device, or the checkpoint is of other
            settings.
    """

    def __init__(
        self,
        env: TrackingEnv,
        experts: Mapping[int, Policy],
        cluster: Sequence[int],
        config: DistillConfig,
        base: Policy | None = None,
        folder: Path | None = None,
    ) -> None:
        check_experts(experts, cluster)
        if torch.device(env.device).type == "cuda":
            torch.set_float32_matmul_precision("high")
        torch.manual_seed(config.seed)
        self.env, self.config, self._folder = env, config, folder
        self._generator = torch.Generator(env.device).manual_seed(config.seed)
        self.student, self.shape = new_student(env, experts, config, base)
        self._experts = {index: experts[index].to(env.device) for index in sorted(set(cluster))}
        self._of_clip = torch.as_tensor(cluster, device=env.device)
        self._optimiser = torch.optim.Adam(self.student.parameters(), lr=config.learning_rate)
        group, memory = env.groups[group_of(env)], self.shape.memory
        sizes = [sum(size for _, size in parts) for parts in (group.parts, group.parts_now)]
        self._sizes = (*sizes, env.num_actions)
        past = (self.shape.history, memory[0] if memory else 0)
        self._data = Aggregate(config.capacity, env.num_envs, self._sizes, past, max(cluster) + 1, env.device)
        self._critic = base.critic_state if base is not None and group_of(env) == "policy" else {}
        self.iteration = 0
        self._rows: list[dict[str, float]] = []
        self._resume()

    @property
    def frames_each(self) -> int:
        """Control steps of all worlds in an iteration."""
        return self.config.steps * self.env.num_envs

    @property
    def gib(self) -> float:
        """Memory of the samples when the ring is full [GiB]."""
        return Aggregate.gib(self._data.steps * self._data.worlds, self._sizes)

    def train(
        self,
        report: Callable[[int, str], None] = lambda frames, note: None,
        enough: Callable[[], bool] = lambda: False,
    ) -> None:
        """Train up to the configured iterations, or until it is `enough`, which is asked after each one.

        `report` is called after each iteration with its frames and a short note.
        """
        config, env = self.config, self.env
        while self.iteration < config.iterations:
            env.progress = 1.0  # the success threshold at its final value
            with within_memory(env.num_envs):
                self._collect(config.expert_share * max(0.0, 1.0 - 2.0 * self.iteration / config.iterations))
                env.engine.check()
                kl, scalars = self._learn(), env.statistics.take()
            counts = self._data.counts[list(self._experts)]
            self.iteration += 1
            kept = {name: scalars[name] for name in ("success", "key_error")}
            told = {"iteration": self.iteration, "frames": self.iteration * self.frames_each}
            self._rows.append(told | {"kl": kl, **kept, "least_share": float(counts.min() / counts.sum())})
            report(self.frames_each, f"KL {kl:.3f}, success {kept['success']:.2f}")
            done = enough()
            if self._folder is not None and (done or self.iteration % config.checkpoint_every == 0):
                self.save_checkpoint(self._folder)
            if done:
                break

    def policy(self) -> Policy:
        """The student as it is now; a copy."""
        actor = new_actor(self.shape)
        actor.load_state_dict(self.student.state_dict())
        return Policy(actor, self._critic, self.shape)

    def curve(self) -> pd.DataFrame:
        """A row an iteration: iteration, frames, kl, success, key_error, least_share (of the samples: a cluster's)."""
        return pd.DataFrame(self._rows)

    def save_checkpoint(self, folder: Path) -> None:
        """Write network, optimiser, draws and curve, whole or not at all."""
        folder.mkdir(parents=True, exist_ok=True)
        content = {
            "settings": self._settings(),
            "student": self.student.state_dict(),
            "optimiser": self._optimiser.state_dict(),
            "generator": self._generator.get_state(),
            "iteration": self.iteration,
            "rows": self._rows,
        }
        save_checkpoint(folder / CHECKPOINT, content)

    def _resume(self) -> None:
        if self._folder is None or not (path := self._folder / CHECKPOINT).exists():
            return
        content, here = load_checkpoint(path), self._settings()
        there = content.get("settings", {})
        for name, value in here.items():
            if there.get(name) != value:
                do = "Remove it, or distil into another folder."
                raise BadInput(f"{path}: {name}", f"{value!r}", repr(there.get(name))[:80], do)
        self.student.load_state_dict(content["student"])
        self._optimiser.load_state_dict(content["optimiser"])
        self._generator.set_state(content["generator"])
        self.iteration, self._rows = content["iteration"], content["rows"]

    def _settings(self) -> dict[str, Any]:
        """Settings that a checkpoint must have been made with, as plain values."""
        free = ("iterations", "checkpoint_every", "env", "transformer", "hidden")
        own = {name: value for name, value in asdict(self.config).items() if name not in free}
        return own | {f"student's {name}": value for name, value in asdict(self.shape).items()}

    @torch.no_grad()
    def _collect(self, expert_share: float) -> None:
        env, student = self.env, self.student
        for _ in range(self.config.steps):
            groups = env.get_observations()
            seen = groups[group_of(env)]
            student.update_normalization({"policy": seen})  # nothing where base's statistics stay
            now = self._of_clip[env.clip]
            wanted, spread = self._answers(groups["policy"], now)
            self._data.add(seen, (wanted, spread), env.episode_length_buf, now)
            leads = torch.rand(env.num_envs, 1, generator=self._generator, device=seen.device) < expert_share
            _, _, dones, _ = env.step(torch.where(leads, wanted, student({"policy": seen})))
            student.reset(dones)

    def _answers(self, known: Tensor, now: Tensor) -> tuple[Tensor, Tensor]:
        """Answers of the expert of each world's cluster `now` (B,) to `known` (B, D): mean and deviation (B, J)."""
        wanted = torch.zeros(self.env.num_envs, self.env.num_actions, device=known.device)
        spread = torch.ones_like(wanted)
        for index, expert in self._experts.items():
            own = Rows(now == index, self.env.engine.by_mask)
            if len(own):
                mean, std = gaussian(expert.actor, own.of(known))
                own.put(wanted, mean)
                own.put(spread, std)
        return wanted, spread

    def _learn(self) -> float:
        """The KL, a mean over clusters, and over the gradient steps of an iteration."""
        config = self.config
        batch, steps = max(self.frames_each // config.mini_batches, 1), config.epochs * config.mini_batches
        total = torch.zeros((), device=self.env.device)
        for _ in range(steps):
            drawn = self._data.draw(batch, self._generator)
            own = believed(self.student, drawn.observation, drawn.known)
            loss = (drawn.weight * gaussian_kl(*own, drawn.mean, drawn.std)).mean()
            self._optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(self.student.parameters(), config.grad_norm)
            self._optimiser.step()
            total += loss.detach()
        return float(total) / steps


def check_experts(experts: Mapping[int, Policy], cluster: Sequence[int]) -> None:
    """Refuse clusters without an expert, and experts with a memory, which would have to see every step.

    Raises:
        BadInput: naming the first.
    """
    if missing := sorted(set(cluster) - set(experts)):
        came = f"none for cluster {missing[0]}"
        raise BadInput("experts", f"one for each of {len(set(cluster))} clusters of motions", came, "Train it first.")
    for index, expert in experts.items():
        if expert.shape.transformer is not None:
            raise BadInput(f"expert {index}", "a policy without a memory", "a transformer", "Distil MLPs.")
