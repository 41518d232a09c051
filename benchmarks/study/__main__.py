"""The command line of the study; see the package."""

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path

import torch

import benchmarks.study
from benchmarks.study.jobs import Job
from benchmarks.study.motions import Motions, prepare, read_motions
from benchmarks.study.pages.curves import draw
from benchmarks.study.pages.generalist_tables import generalist_tables
from benchmarks.study.parts import PARTS
from benchmarks.study.settings import SMALL, Study, freeze
from benchmarks.study.steps import Places, Runner, Step
from benchmarks.study.training import DONE, finished
from benchmarks.study.trying import TRIALS
from bumblebee.errors import EXIT_BAD_INPUT, BadInput

LATER = "the call is over: the same command goes on"


def study_of(options: argparse.Namespace) -> Study:
    """The study's settings."""
    return SMALL if options.small else Study()


def run_part(options: argparse.Namespace) -> None:
    """Train and try all policies of a part, or as far as the time goes."""
    study, motions = study_of(options), read_motions(options.motions)
    present = torch.cuda.device_count()
    if study.env.engine == "mujoco_warp" and not 1 <= options.gpus <= present:
        raise BadInput(
            "--gpus", f"1 to {present} GPUs of this machine" if present else "a machine with a GPU", str(options.gpus)
        )
    freeze(options.out, study, motions=motions.hash)
    jobs = chosen(PARTS[options.part].jobs(of_seeds(study, options.seeds), motions), options.only)
    for job in jobs:
        finished(options.out, job)  # refuses what was trained otherwise
    seconds = None if options.minutes is None else 60 * options.minutes
    gpus = options.gpus if study.env.engine == "mujoco_warp" else 0
    steps = [step for job in jobs for step in steps_of(job, options)]
    runner = Runner(steps, Places(gpus, options.each, options.jobs), options.out / "logs", seconds)
    whole = runner.run()
    if runner.failed:
        raise SystemExit(f"failed: {', '.join(runner.failed)}; see {options.out / 'logs'}")
    print("done" if whole else LATER, flush=True)


def of_seeds(study: Study, seeds: list[int] | None) -> Study:
    """The study with some of its seeds.

    Raises:
        BadInput: if it has no such seed.
    """
    if unknown := sorted(set(seeds or ()) - set(study.seeds)):
        raise BadInput("--seeds", f"some of {', '.join(map(str, study.seeds))}", ", ".join(map(str, unknown)))
    return replace(study, seeds=tuple(seed for seed in study.seeds if seeds is None or seed in seeds))


def chosen(jobs: list[Job], only: list[str] | None) -> list[Job]:
    """The jobs of these names and those that they start from or learn from.

    Raises:
        BadInput: if there is no such job.
    """
    if only is None:
        return jobs
    by_name, wanted = {job.name: job for job in jobs}, list(only)
    if unknown := sorted(set(only) - set(by_name)):
        raise BadInput("--only", f"some of {', '.join(by_name)}", ", ".join(unknown))
    for name in wanted:  # grows while it is gone through
        job = by_name[name]
        wanted += [need for need in needs_of(job) if need not in wanted]
    return [job for job in jobs if job.name in wanted]


def needs_of(job: Job) -> tuple[str, ...]:
    """Names of the jobs whose policies a job starts from or learns from."""
    return tuple(dict.fromkeys((*((job.parent,) if job.parent else ()), *job.experts)))


def steps_of(job: Job, options: argparse.Namespace) -> tuple[Step, Step]:
    """A job's training and its trials."""
    shared = ("--motions", str(options.motions), "--out", str(options.out))
    small = ("--small",) if options.small else ()
    train = ("benchmarks.study.training", options.part, job.name, *shared, *small)
    trial = ("benchmarks.study.trying", job.name, *shared)
    folder, name = options.out / job.name, f"{job.name}.train"
    parents = tuple(f"{need}.train" for need in needs_of(job))
    return (
        Step(name, train, folder / DONE, parents, gpu=True),
        Step(f"{job.name}.trial", trial, folder / TRIALS, (name,)),
    )


def run_prepare(options: argparse.Namespace) -> None:
    """Read the sources and write the study's motions."""
    motions = prepare(options.sources, options.out, options.texts, options.clusters)
    print(_counted(motions))
    print((options.out / "clusters.txt").read_text(), end="")


def run_table(options: argparse.Namespace) -> None:
    """Write the tables of a finished run."""
    if options.arms and options.part != "generalist":
        raise BadInput("--arms", "the part generalist", options.part)
    study, motions = study_of(options), read_motions(options.motions)
    stamp = freeze(options.run, study, motions=motions.hash)
    study = of_seeds(study, options.seeds)
    tables = partial(generalist_tables, arms=options.arms) if options.arms else PARTS[options.part].tables
    text = tables(options.run, study, motions)
    options.out.write_text(f"<!-- study {stamp}, motions {motions.hash} -->\n\n{text}")
    print(text, end="")
    if options.curves:
        draw(options.run, PARTS[options.part].jobs(study, motions), options.curves)


def _counted(motions: Motions) -> str:
    table = motions.labels.groupby("split").agg(
        pieces=("name", "size"), motions=("motion", "nunique"), seconds=("seconds", "sum")
    )
    return table.to_string()


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=benchmarks.study.__doc__.splitlines()[0])
    commands = parser.add_subparsers(required=True)
    own = commands.add_parser("prepare", help="read, hold out, filter and cluster the motions")
    own.add_argument("sources", nargs="+", type=Path)
    own.add_argument("--texts", type=Path, help="HumanML3D's folder")
    own.add_argument("--clusters", type=int, default=0, help="0: as many as the elbow says")
    own.add_argument("--out", type=Path, required=True)
    own.set_defaults(work=run_prepare)
    own = commands.add_parser("run", help="train and try the policies of a part")
    own.add_argument("part", choices=PARTS, help="; ".join(f"{name}: {part.what}" for name, part in PARTS.items()))
    own.add_argument("--gpus", type=int, default=1)
    own.add_argument("--each", type=int, default=2, help="trainings beside each other on a GPU")
    own.add_argument("--jobs", type=int, default=2, help="processor cores that try policies")
    own.add_argument("--minutes", type=float, help="end this call after so long")
    own.add_argument("--only", nargs="+", metavar="POLICY", help="these policies and what they start from")
    own.add_argument("--out", type=Path, required=True)
    own.set_defaults(work=run_part)
    table = commands.add_parser("table", help="the tables of a finished run")
    table.add_argument("part", choices=PARTS)
    table.add_argument("run", type=Path)
    table.add_argument("--out", type=Path, required=True, help="Markdown file")
    table.add_argument("--arms", nargs="+", metavar="ARM", help="of the part generalist, where not all were run")
    table.add_argument("--curves", type=Path, help="also draw the learning curves into this .svg")
    table.set_defaults(work=run_table)
    for part in (own, table):
        part.add_argument("--seeds", nargs="+", type=int, help="some of the study's seeds")
        part.add_argument("--motions", type=Path, required=True)
        part.add_argument("--small", action="store_true", help="the same in seconds on two cores: shows that it runs")
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> None:
    """Run a command; bad input is one line and status 2."""
    options = parse(arguments)
    try:
        options.work(options)
    except BadInput as error:
        print(error)
        raise SystemExit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    main()
