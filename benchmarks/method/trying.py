"""Tries policies of a run: experts each on its own cluster's motions, every other policy on all."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import mujoco
import pandas as pd
import torch
from torch import Tensor

from benchmarks.baselines.others.follow import follow
from benchmarks.method.places import RANDOM, experts
from benchmarks.method.settings import Method
from benchmarks.method.students import is_student
from benchmarks.study.motions import Motions
from benchmarks.study.on_robot import write_csv
from benchmarks.study.sealed_trials import chosen_clips, follow_sealed
from bumblebee.learning.policy import Policy, load_policy
from bumblebee.learning.rollout import Manner
from bumblebee.motion.clip import Clip
from bumblebee.stand_in.sealed import read_sealed
from bumblebee.tracking.config import Randomisation
from bumblebee.tracking.model import task_model
from bumblebee.tracking.presets import PAPER_RANDOMISATION

ROBOTS: dict[str, Randomisation | None] = {"declared": None, "drawn": PAPER_RANDOMISATION}
"""Each piece once on the declared robot, once on a robot of its own of the paper's randomisation, the same for all."""
_AT_ONCE = 64
Follow = Callable[[Policy, Manner, list[Clip]], pd.DataFrame]


class Trying:
    """Trials of a run.

    Args:
        method: its settings.
        motions: the study's.
        out: the run's folder.
        robots: folder of the sealed robots.
    """

    def __init__(self, method: Method, motions: Motions, out: Path, robots: Path) -> None:
        self.method, self.motions, self.out, self.robots = method, motions, out, robots
        torch.set_num_threads(1)

    def tried(self, who: str, shard: int) -> None:
        """The shard's part of all pieces, from the true state, on the declared robot and on drawn ones."""
        tables = []
        for robot, drawn in ROBOTS.items():
            task = replace(self.method.env, randomisation=drawn or Randomisation(), engine="mujoco")
            model = task_model(task)
            clips = [row.clip for row in self.motions.rows]
            table = self._each(who, shard, clips, lambda *one, m=model, d=drawn: follow(*one, m, robots=d))  # type: ignore[misc]
            tables.append(table.assign(robot=robot))
        write_csv(self.out / who / f"tried-{shard}.csv", pd.concat(tables, ignore_index=True))

    def sealed(self, who: str, robot: str, shard: int) -> None:
        """The shard's part of the robots' motions, from readings, on a sealed robot."""
        mujoco.set_mju_user_warning(lambda text: None)  # a robot that falls apart is a fall
        effects = read_sealed(self.robots / f"{robot}.json")
        clips = chosen_clips(self.motions, self.method.max_seconds)
        base = self.method.tried_base
        table = self._each(who, shard, clips, lambda *one: follow_sealed(*one, effects, base))
        write_csv(self.out / who / f"sealed-{robot}-{shard}.csv", table.assign(robot=robot))

    def _each(self, who: str, shard: int, clips: list[Clip], follow_all: Follow) -> pd.DataFrame:
        """Rows of the shard's clips, the same batches of clips whoever follows them."""
        if is_student(who):
            names, owners = [who], [0] * len(clips)
        else:
            names = experts(who, self.motions.clusters, self.method.rounds)
            owners = self.motions.cluster_indices(clips, self.method.seed if who == RANDOM else None)
        policies = [load_policy(self.out / name) for name in names]
        own, tables = list(zip(clips, owners, strict=True))[shard :: self.method.shards], []
        for first in range(0, len(own), _AT_ONCE):
            part = own[first : first + _AT_ONCE]
            actor = policies[0] if len(set(names)) == 1 else Experts(policies, [owner for _, owner in part])
            tables.append(follow_all(actor, Manner(actor.shape.seen), [clip for clip, _ in part]))
        return pd.concat(tables, ignore_index=True)


class Experts(Policy):
    """Experts of one shape as one policy: each robot is moved by the expert that its motion belongs to.

    Args:
        policies: the experts.
        owners: (N,) index of each robot's expert.
    """

    def __init__(self, policies: Sequence[Policy], owners: Sequence[int]) -> None:
        super().__init__(policies[0].actor, {}, policies[0].shape)
        self._policies, self._owners = policies, torch.as_tensor(owners)

    def advance(self, observation: Tensor, memory: Tensor | None) -> tuple[Tensor, Tensor | None]:
        """Mean actions (N, J) of observations (N, D); experts have no memory."""
        actions = torch.zeros(len(observation), self.shape.actions)
        for index in set(self._owners.tolist()):
            rows = self._owners == index
            actions[rows] = self._policies[index].advance(observation[rows], None)[0]
        return actions, None
