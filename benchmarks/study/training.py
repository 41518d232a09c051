"""Trains one job of the study in this process, up to its steps or until the call is over; goes on exactly.

    python -m benchmarks.study.training PART JOB --motions study/motions --out study/experts --seconds 500

is what the study starts for each job, on the GPU that CUDA_VISIBLE_DEVICES names.
"""

import argparse
import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import MISSING, asdict, fields, replace
from pathlib import Path

import torch

from benchmarks.study.correction import DECLARED, Correction
from benchmarks.study.distilling import distil
from benchmarks.study.jobs import DONE, OTHERS, Job
from benchmarks.study.motions import Motions, read_motions
from benchmarks.study.others import make_env, teachers_task
from benchmarks.study.parts import PARTS
from benchmarks.study.settings import SMALL, Study, settings_of
from benchmarks.study.steps import GOES_ON
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.learning.config import PpoConfig
from bumblebee.learning.learner import CHECKPOINT
from bumblebee.learning.ppo.learner import Trainer
from bumblebee.motion.clip import Clip
from bumblebee.sim.engine_choice import make_engine
from bumblebee.tracking.env import TrackingEnv
from bumblebee.tracking.model import task_model
from bumblebee.tracking.sampling.library import MotionLibrary
from bumblebee.tracking.sampling.sampler import ClipShares

CHECKPOINT_EVERY = 60
"""Iterations: some 15 s of a GPU."""


def finished(out: Path, job: Job) -> bool:
    """Whether the job's policy is there, trained as the job says.

    Raises:
        BadInput: if the one that is there was trained otherwise.
    """
    path = out / job.name / DONE
    if not path.exists():
        return False
    unsaid = {own.name: own.default for own in fields(Job) if own.default is not MISSING}
    if unsaid | json.loads(path.read_text())["job"] != _plain(job):
        raise BadInput(path, f"a policy trained as {job.name} is now", "another training", "Use a new --out.")
    return True


def train(
    job: Job,
    motions: Motions,
    study: Study,
    out: Path,
    correction: Correction = DECLARED,
    over: Callable[[], bool] = lambda: False,
) -> bool:
    """Train the job's policy into `out / job.name`; whether it is done.

    Args:
        job: what to train.
        motions: the study's.
        study: its settings.
        out: the run's folder, with the parent's policy in it.
        correction: what the robot is taken to be, beside what is declared.
        over: says when to stop and keep a checkpoint.
    """
    if finished(out, job):
        return True
    if job.arm is not None:
        return _distilled(job, motions, study, out, over)
    folder = out / job.name
    folder.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(study.env.threads)
    clips = [row.clip for row in motions.training(job.clips)]
    if job.settings in OTHERS:
        own = teachers_task(study, job.settings)
        env, ppo = make_env(own, clips, job.seed), own.ppo
    else:
        shares = ClipShares.equal(motions.cluster_indices(clips)) if job.even else None
        env, ppo = _environment(job, clips, study, correction, shares)
    frames = env.num_envs * ppo.steps
    ppo = replace(ppo, iterations=math.ceil(job.steps / frames), checkpoint_every=CHECKPOINT_EVERY)
    trainer = Trainer(env, ppo, folder, job.seed, None if job.parent is None else out / job.parent)
    trainer.train(job.name, over)
    if trainer.iteration < ppo.iterations:
        trainer.save_checkpoint()
        return False
    trainer.policy().save(folder)
    told = {"job": _plain(job), "frames": trainer.frames, "seconds": round(trainer._seconds, 1), "clips": len(clips)}
    (folder / DONE).write_text(json.dumps(told) + "\n")
    (folder / CHECKPOINT).unlink(missing_ok=True)
    return True


def _environment(
    job: Job, clips: Sequence[Clip], study: Study, correction: Correction, shares: ClipShares | None
) -> tuple[TrackingEnv, PpoConfig]:
    """The job's task on its own engine, and its algorithm."""
    task, ppo = settings_of(study, job.settings, job.parent is not None)
    model = task_model(task, correction.model)
    engine = make_engine(
        task.engine, model, task.num_worlds, task.threads, hooks=correction.hooks(model), buffers=task.buffers
    )
    library = MotionLibrary(clips, task.ahead, device=engine.device)
    return TrackingEnv(library, engine, task, job.seed, correction.adapter(), shares), ppo


def _distilled(job: Job, motions: Motions, study: Study, out: Path, over: Callable[[], bool]) -> bool:
    loss = distil(job, motions, study, out, over)
    if loss is not None:
        told = {"job": _plain(job), "loss" if job.arm in OTHERS else "kl": round(loss, 4)}
        (out / job.name / DONE).write_text(json.dumps(told) + "\n")
    return loss is not None


def deadline(seconds: float | None) -> Callable[[], bool]:
    """Says when so many seconds are over; never without."""
    end = math.inf if seconds is None else time.monotonic() + seconds
    return lambda: time.monotonic() > end


def _plain(job: Job) -> dict:
    return json.loads(json.dumps(asdict(job)))


def main() -> None:
    """Train one job; exit code 3: not done when the time was over."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("part", choices=PARTS)
    parser.add_argument("job")
    parser.add_argument("--motions", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--small", action="store_true")
    options = parser.parse_args()
    over = deadline(options.seconds)
    study = SMALL if options.small else Study()
    try:
        motions = read_motions(options.motions)
        job = {job.name: job for job in PARTS[options.part].jobs(study, motions)}[options.job]
        done = train(job, motions, study, options.out, over=over)
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None
    raise SystemExit(0 if done else GOES_ON)


if __name__ == "__main__":
    main()
