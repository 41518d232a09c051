"""Other groups' methods in the study: their teachers' task and their students' training, on the study's motions.

What each is stands in docs/baselines.md; engine, worlds and the robots' randomisation are the study's.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd
import torch

from benchmarks.baselines.others.dagger import CHECKPOINT, CURVE, Distiller
from benchmarks.baselines.others.env import BaselineEnv
from benchmarks.baselines.others.library import MovingLibrary
from benchmarks.baselines.others.registry import baseline
from benchmarks.baselines.others.spec import Baseline
from benchmarks.study.jobs import OTHERS, Job
from benchmarks.study.motions import Motions
from benchmarks.study.settings import Study
from bumblebee.learning.policy import Policy, load_policy
from bumblebee.learning.rollout import Manner
from bumblebee.motion.clip import Clip
from bumblebee.progress import progress
from bumblebee.sim.engine_choice import make_engine
from bumblebee.tracking.config import ObservationConfig
from bumblebee.tracking.model import task_model


def other(study: Study, name: str) -> Baseline:
    """The method of that name on the study's engine, with the study's randomisation."""
    own, task = baseline(name), study.env
    shared = {key: getattr(task, key) for key in ("engine", "num_worlds", "physics_hz", "threads", "buffers")}
    return replace(own, env=replace(own.env, **shared, randomisation=task.randomisation))


def teachers_task(study: Study, name: str) -> Baseline:
    """Task that its teacher learns in: what only the student sees is not computed."""
    own = other(study, name)
    return replace(own, env=replace(own.env, student=ObservationConfig(terms=())))


def students_task(study: Study, name: str) -> Baseline:
    """Task that its student learns in: the teacher answers what it sees without noise."""
    own = other(study, name)
    exact = replace(own.env.observation, noise=0.0)
    return replace(own, env=replace(own.env, observation=exact, num_worlds=study.distil.worlds))


def make_env(own: Baseline, clips: Sequence[Clip], seed: int) -> BaselineEnv:
    """The method's environment on its own engine."""
    task = own.env
    engine = make_engine(task.engine, task_model(task), task.num_worlds, task.threads, buffers=task.buffers)
    return BaselineEnv(MovingLibrary(clips, task.ahead, device=engine.device), engine, own, seed)


def distil_other(job: Job, motions: Motions, study: Study, out: Path, over: Callable[[], bool]) -> float | None:
    """Distil a student into `out / job.name`; loss at the end (mean of the last tenth), None where it is not done.

    Args:
        job: a student's.
        motions: the study's; those that are not held out are learnt from.
        study: its settings.
        out: the run's folder, with the teacher.
        over: says when to stop and keep a checkpoint.
    """
    assert job.parent is not None
    own, folder = students_task(study, job.settings), out / job.name
    folder.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(study.env.threads)
    teacher = load_policy(out / job.parent)
    env = make_env(own, [row.clip for row in motions.training()], job.seed)
    distiller = Distiller(env, teacher, own.student, folder, job.seed)
    each = own.student.steps * env.num_envs
    wanted = math.ceil(job.steps / each)
    with progress(wanted * each, f"distil {job.name}", "frames", start=distiller.frames) as bar:

        def enough() -> bool:
            bar.update(distiller.frames - bar.done)
            return distiller.iteration >= wanted or over()

        distiller.train(enough, every=max(wanted // 100, 1))
    if distiller.iteration < wanted:
        distiller.save_checkpoint()
        return None
    distiller.policy().save(folder)
    (folder / CHECKPOINT).unlink(missing_ok=True)
    losses = pd.read_csv(folder / CURVE)["loss"]
    return float(losses.tail(max(len(losses) // 10, 1)).mean())


def manner(job: Job, policy: Policy) -> Manner:
    """How a job's policy is run when it is tried."""
    if job.settings not in OTHERS:
        return Manner(policy.shape.seen)
    own = baseline(job.settings)
    seen = own.env.observation if job.arm is None else own.tried or own.env.student
    return Manner(seen, own.scale)
