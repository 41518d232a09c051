"""Distils one job of the study by DAgger, of the policies that the run has."""

from collections.abc import Callable
from pathlib import Path

import torch

from benchmarks.generalist import ARMS, Case, settings_of
from benchmarks.study.jobs import OTHERS, Job
from benchmarks.study.motions import Motions
from benchmarks.study.others import distil_other
from benchmarks.study.settings import Study
from benchmarks.study.settings import settings_of as trained_with
from bumblebee.learning.generalist.distill import CHECKPOINT
from bumblebee.learning.generalist.teacher_student import generalist_of
from bumblebee.learning.policy import load_policy
from bumblebee.progress import progress

CURVE = "distill.csv"


def distil(job: Job, motions: Motions, study: Study, out: Path, over: Callable[[], bool]) -> float | None:
    """Distil into `out / job.name`; KL at the end (mean of the last tenth), None where it is not done.

    Args:
        job: with an arm and its experts.
        motions: the study's; those that are not held out are learnt from.
        study: its settings.
        out: the run's folder, with the experts and the parent.
        over: says when to stop and keep a checkpoint.
    """
    assert job.arm is not None and job.parent is not None
    if job.arm in OTHERS:
        return distil_other(job, motions, study, out, over)
    own, folder = study.distil, out / job.name
    folder.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(study.env.threads)
    kind = job.arm if job.arm in ARMS else "transformer"  # the others differ by whom they learn from
    case = Case(kind, job.seed, own.iterations, own.worlds, own.steps, own.rate, own.capacity, study.env.engine)
    config = settings_of(case, trained_with(study, "ours", child=True)[0])
    clips = [row.clip for row in motions.training()]
    experts = {index: load_policy(out / name) for index, name in enumerate(job.experts)}
    base = load_policy(out / job.parent)
    clusters = motions.cluster_indices(clips, job.seed if job.arm == "random" else None)
    distiller = generalist_of(clips, clusters, experts, config, folder, base)
    if distiller.iteration < own.iterations:
        before = distiller.iteration * distiller.frames_each
        with progress(own.frames, f"distil {job.name}", "frames", start=before) as bar:
            distiller.train(bar.update, over)
    if distiller.iteration < own.iterations:
        distiller.save_checkpoint(folder)
        return None
    curve = distiller.curve()
    curve.to_csv(folder / CURVE, index=False)
    distiller.policy().save(folder)
    (folder / CHECKPOINT).unlink(missing_ok=True)
    return float(curve["kl"].tail(max(len(curve) // 10, 1)).mean())
