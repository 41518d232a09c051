"""The paper's two steps to a policy for the robot: a privileged teacher by PPO, then a student of it by DAgger.

Appendix A: the teacher sees 5 control steps with the targets in global coordinates, the student 10 of what a robot
senses. Both learn in the same task, for instance `tracking.presets.PAPER_TASK`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd

from bumblebee.learning.config import PAPER, PpoConfig
from bumblebee.learning.generalist.distill import PAPER_DAGGER, DistillConfig, Distiller, check_experts, distill
from bumblebee.learning.policy import Policy
from bumblebee.learning.ppo.learner import Trainer
from bumblebee.motion.clip import Clip
from bumblebee.sim.engine_choice import make_engine
from bumblebee.tracking.config import EnvConfig, ObservationConfig
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.model import task_model
from bumblebee.tracking.presets import PAPER_TASK, STUDENT, distillation_task
from bumblebee.tracking.sampling.library import MotionLibrary
from bumblebee.tracking.sampling.sampler import ClipShares

PAPER_GENERALIST = replace(
    PAPER_DAGGER, model="transformer", capacity=10_000_000, env=distillation_task(PAPER_TASK, STUDENT)
)
"""Appendices B and C: a Gated Transformer-XL by DAgger. How many samples are kept the paper does not say: 5.8 GiB."""


def make_env(
    clips: Sequence[Clip], task: EnvConfig, seed: int = 0, share: ClipShares | None = None, model: Path | None = None
) -> TrackingEnv:
    """The task on its own engine.

    Args:
        clips: what is followed.
        task: see `EnvConfig`.
        seed: of every draw.
        share: shares of the draws of groups of clips, if they are to hold whatever fails.
        model: MJCF of a corrected robot; the declared one if there is none.
    """
    engine = make_engine(task.engine, task_model(task, model), task.num_worlds, task.threads, buffers=task.buffers)
    library = MotionLibrary(clips, task.ahead, device=engine.device)
    return TrackingEnv(library, engine, task, seed, clip_share=share)


def train_teacher(
    clips: Sequence[Clip],
    folder: Path,
    task: EnvConfig = PAPER_TASK,
    ppo: PpoConfig = PAPER,
    seed: int = 0,
    enough: Callable[[], bool] = lambda: False,
) -> Policy:
    """Train up to `ppo.iterations` or until it is `enough`; `folder` gets curve and checkpoint, and is gone on from."""
    trainer = Trainer(make_env(clips, task, seed), ppo, folder, seed)
    trainer.train("teacher", enough)
    trainer.save_checkpoint()
    return trainer.policy()


def generalist_of(
    clips: Sequence[Clip],
    cluster: Sequence[int],
    experts: Mapping[int, Policy],
    config: DistillConfig = PAPER_GENERALIST,
    folder: Path | None = None,
    base: Policy | None = None,
    model: Path | None = None,
) -> Distiller:
    """All experts into one policy, each cluster with the same share of the draws: train it, then ask for the policy.

    Args:
        clips: N motions of all clusters.
        cluster: (N,) cluster index of each.
        experts: cluster index -> its expert.
        config: model, algorithm and task; `config.env.student` is what the generalist sees.
        folder: for the checkpoint, which is gone on from.
        base: see `Distiller`.
        model: MJCF of a corrected robot; the declared one if there is none.
    """
    check_experts(experts, cluster)
    env = make_env(clips, config.env, config.seed, ClipShares.equal(cluster), model)
    return Distiller(env, experts, cluster, config, base, folder)


def train_student(
    clips: Sequence[Clip],
    teacher: Policy,
    task: EnvConfig = PAPER_TASK,
    config: DistillConfig = PAPER_DAGGER,
    student: ObservationConfig = STUDENT,
    report: Callable[[int, str], None] = lambda frames, note: None,
    enough: Callable[[], bool] = lambda: False,
) -> tuple[Policy, pd.DataFrame]:
    """Distil the teacher into a student who sees `student`, in the teacher's task; the policy and the curve."""
    env = make_env(clips, distillation_task(task, student), config.seed)
    return distill(env, {0: teacher}, [0] * len(clips), config, report=report, enough=enough)
