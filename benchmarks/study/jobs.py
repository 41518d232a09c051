"""Jobs of the study: each policy, from which parent, on which motions, for how many steps."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks.study.motions import Motions
from benchmarks.study.settings import Study
from bumblebee.errors import BadInput

DONE = "done.json"
"""File in a job's folder that says how it was trained; written last."""


@dataclass(frozen=True)
class Job:
    """One policy. Its folder in the run is its name."""

    name: str
    steps: float
    """Control steps of its own, beside its parent's."""
    seed: int
    parent: str | None = None
    """Name of the job whose policy it starts from."""
    clips: tuple[str, ...] | None = None
    """Names of the pieces that it learns from; None: all that are not held out."""
    settings: str = "ours"
    """Name of its task and algorithm, see `settings.settings_of`."""
    even: bool = False
    """Whether each cluster gets an equal share of the draws, however long its motions are."""
    arm: str | None = None
    """Name in `GENERALISTS`, `MORE_GENERALISTS` or `OTHERS` of what is distilled by DAgger; None: it learns by PPO."""
    experts: tuple[str, ...] = ()
    """Names of the jobs that it is distilled from, one for each cluster in their order."""


def experts_jobs(study: Study, motions: Motions) -> list[Job]:
    """For each seed a base policy and what is trained on from it; long jobs come first.

    From a base policy: an expert of each cluster, one of each random cluster, and one policy trained on by the steps of
    all experts together, drawing motions by their length or each cluster as often.
    """
    jobs: list[Job] = []
    for seed in study.seeds:
        jobs.append(Job(base_of(seed), study.base_steps, seed))
    for seed in study.seeds:
        steps = study.expert_steps * len(motions.clusters)
        jobs.append(Job(one_of(seed), steps, seed, base_of(seed)))
        jobs.append(Job(even_of(seed), steps, seed, base_of(seed), even=True))
    for seed in study.seeds:
        for groups in (motions.labels.set_index("name")["cluster"], motions.random_clusters(seed)):
            for cluster in sorted(groups.unique()):
                own = tuple(groups.index[groups == cluster])
                jobs.append(Job(expert_of(seed, cluster), study.expert_steps, seed, base_of(seed), own))
    return jobs


PAPER_ARMS = {
    "printed": "as printed",
    "std": "printed, first deviation .2",
    "ramp": "printed, penalties from .05 up over half of the training",
    "adaptive": "printed, learning rate by KL",
    "three": "all three",
    "three-std": "all three but the deviation",
    "three-ramp": "all three but the ramp",
    "three-adaptive": "all three but the rate",
    "reference": "all three, action around the reference",
    "floor": "all three, a step earns at least 0",
    "actions": "all three, action terms a hundredth",
    "limits": "and limits as ours",
    "feet": "and feet as ours",
    "kernels": "and kernels as ours",
    "ours": "all three, our rewards",
    "ours-reference": "all three, our rewards, action around the reference",
    "task": "our task, first deviation .2, learning rate by KL",
    "algorithm": "our rewards and algorithm",
    "algorithm-flat": "our rewards and algorithm, flat ground",
    "algorithm-reference": "our rewards and algorithm, action around the reference",
    "algorithm-seen": "our rewards and algorithm, our observation",
    "algorithm-ends": "our rewards and algorithm, our ends of episodes",
    "task-algorithm": "our task and algorithm",
    "floor-algorithm": "our algorithm, penalties from .05 up, a step earns at least 0",
    "actions-algorithm": "our algorithm, penalties from .05 up, action terms a hundredth",
    "limits-algorithm": "and limits as ours, our algorithm",
    "feet-algorithm": "and feet as ours, our algorithm",
    "kernels-algorithm": "and kernels as ours, our algorithm",
    "algorithm-std": "our rewards and algorithm, first deviation .2",
    "ours-wide": "our rewards, learning rate by KL, first deviation .8",
    "actions-seen": "our algorithm and observation, action terms a hundredth",
}
"""Arms of the part `paper-task`, by name of their settings; `settings.PAPER_CHANGES` has what they change."""
PAPER_LONGER = ("algorithm-seen", "actions-seen")
"""Arms that are also trained by as many steps as a base policy."""


def paper_jobs(study: Study, motions: Motions) -> list[Job]:
    """The paper's teacher from nothing, a policy for each arm, all of equal steps; then some with more."""
    seed = study.seeds[0]
    jobs = [Job(paper_of(seed, arm), study.paper_steps, seed, settings=f"paper-{arm}") for arm in PAPER_ARMS]
    return jobs + [Job(longer_of(seed, arm), study.base_steps, seed, settings=f"paper-{arm}") for arm in PAPER_LONGER]


SURVIVORS = {
    "place": "judged in its own place, and seeing it alone",
    "wide": "wider randomisation",
    "history": "ten steps of proprioception",
    "loose": "episodes end at .8 m throughout",
    "place-history": "own place, seeing it alone, ten steps",
    "judged": "judged in its own place",
    "default": "actions around the stand",
    "place-loose": "own place, seeing it alone, .8 m throughout",
}
"""Arms of the part `robust`, by name of their settings; `settings.ROBUST_CHANGES` has what they change."""


def robust_jobs(study: Study, motions: Motions) -> list[Job]:
    """For each seed the base policy and, from nothing and of equal steps, one of each change of its task."""
    jobs: list[Job] = []
    for seed in study.seeds:
        jobs.append(Job(base_of(seed), study.base_steps, seed))
        jobs += [Job(arm_of(seed, arm), study.base_steps, seed, settings=f"robust-{arm}") for arm in SURVIVORS]
    return jobs


GENERALISTS = {
    "transformer": "transformer, of the experts",
    "mlp": "MLP of equal size, of the experts",
    "init": "transformer, of the base policy",
    "seeing": "MLP that sees what the experts see, of the experts",
}
"""Arms of the part `generalist`; all but the last see what a robot senses. `init` is the paper's General Init."""


MORE_GENERALISTS = {
    "general": "General Init: transformer, of the one policy",
    "random": "Random: transformer, of experts of random clusters",
}
"""Further ones of the part `table-1`, as `transformer` is but for whom they learn from; all have equal steps."""
OTHERS = {"omnih2o": "OmniH2O", "exbody2": "Exbody2", "hover": "HOVER"}
"""Other groups' methods of the part `table-1`, by their names in `benchmarks.baselines.others.registry`."""


def generalist_jobs(study: Study, motions: Motions) -> list[Job]:
    """For each seed the experts by cluster, the one policy at equal steps, and what is distilled of them."""
    jobs: list[Job] = []
    for seed in study.seeds:
        own = experts_jobs(replace(study, seeds=(seed,)), motions)
        experts = experts_of(seed, motions.clusters)
        kept = {job.name: job for job in own if job.name in (base_of(seed), *experts)}
        base, frames = base_of(seed), study.distil.frames
        teachers = {arm: (base,) * len(experts) if arm == "init" else experts for arm in GENERALISTS}
        distilled = [Job(arm_of(seed, arm), frames, seed, base, arm=arm, experts=teachers[arm]) for arm in GENERALISTS]
        longer = [job for job in own if job.name in (one_of(seed), even_of(seed))]
        jobs += [*kept.values(), *distilled, *longer]
    return jobs


def table_1_jobs(study: Study, motions: Motions) -> list[Job]:
    """For each seed the paper's method, its controls and other groups' methods.

    All have as many control steps in all: a teacher those of the base policy and the experts together, a student those
    of a generalist.
    """
    jobs: list[Job] = []
    for seed in study.seeds:
        own = replace(study, seeds=(seed,))
        ours = {job.name: job for job in generalist_jobs(own, motions)}
        every = {job.name: job for job in experts_jobs(own, motions)} | ours
        pupil = ours[arm_of(seed, "transformer")]
        random = experts_of(seed, random_names(motions))
        teachers = {"general": (one_of(seed),) * len(random), "random": random}
        first = [every[name] for name in (base_of(seed), one_of(seed), *pupil.experts)]
        jobs += [*first, replace(pupil, name=arm_of(seed, "general"), arm="general", experts=teachers["general"])]
        steps = study.base_steps + study.expert_steps * len(motions.clusters)
        for name in OTHERS:
            jobs.append(Job(teacher_of(seed, name), steps, seed, settings=name))
        jobs += [pupil, *(every[name] for name in random)]
        for name in OTHERS:
            teacher = teacher_of(seed, name)
            frames = study.distil.frames
            jobs.append(Job(arm_of(seed, name), frames, seed, teacher, settings=name, arm=name, experts=(teacher,)))
        jobs.append(replace(pupil, name=arm_of(seed, "random"), arm="random", experts=random))
    return jobs


def random_names(motions: Motions) -> list[str]:
    """Names of the random clusters, as many as there are clusters."""
    return [f"r{index}" for index in range(len(motions.clusters))]


def arm_of(seed: int, arm: str) -> str:
    """Name of an arm's generalist or student."""
    return f"s{seed}-{arm}"


def teacher_of(seed: int, method: str) -> str:
    """Name of the teacher of another group's method."""
    return f"s{seed}-{method}-teacher"


def paper_of(seed: int, arm: str) -> str:
    """Name of an arm's policy."""
    return f"s{seed}-paper-{arm}"


def longer_of(seed: int, arm: str) -> str:
    """Name of an arm's policy that was trained by as many steps as a base policy."""
    return f"{paper_of(seed, arm)}-longer"


def base_of(seed: int) -> str:
    """Name of a seed's base policy."""
    return f"s{seed}-base"


def one_of(seed: int) -> str:
    """Name of the one policy that is trained on by all experts' steps."""
    return f"s{seed}-one"


def even_of(seed: int) -> str:
    """Name of the one policy that draws each cluster as often."""
    return f"s{seed}-even"


def expert_of(seed: int, cluster: str) -> str:
    """Name of a cluster's expert; random clusters are r0, r1 ..."""
    return f"s{seed}-{cluster}"


def experts_of(seed: int, clusters: Sequence[str]) -> tuple[str, ...]:
    """Names of the experts of some clusters."""
    return tuple(expert_of(seed, cluster) for cluster in clusters)


def job_of(folder: Path) -> Job:
    """The job whose finished policy is in `folder`.

    Raises:
        BadInput: if there is none.
    """
    path = Path(folder) / DONE
    if not path.exists():
        raise BadInput(path, "a finished policy of a run", "no such file", "Train it first.")
    told = json.loads(path.read_text())["job"]
    return Job(**{name: tuple(value) if isinstance(value, list) else value for name, value in told.items()})
