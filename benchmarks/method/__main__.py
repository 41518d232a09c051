"""The command line of the method's run; see the package."""

import argparse
import json
from pathlib import Path

import torch

import benchmarks.method
from benchmarks.method.on_robot import recorded_motions
from benchmarks.method.plan import DONE, Plan
from benchmarks.method.settings import NAMED, Method, chosen
from benchmarks.study.motions import Motions, read_motions
from benchmarks.study.settings import freeze
from benchmarks.study.steps import Places, Runner, Step
from bumblebee.errors import BadInput
from bumblebee.io.write import write_file
from bumblebee.last_line import guarded
from bumblebee.stand_in.sealed import read_sealed

LATER = "the call is over: the same command goes on"


def run(options: argparse.Namespace) -> None:
    """Do all steps, or as many as the time goes."""
    method, motions = chosen(options.settings, options.seed), read_motions(options.motions)
    gpus = options.gpus if method.env.engine == "mujoco_warp" else 0
    steps = begun(options, method, motions)
    wanted = [step for step in steps if options.only is None or step.name.split()[0] in options.only]
    there = torch.cuda.device_count()
    if method.env.engine == "mujoco_warp" and not 1 <= gpus <= there and any(step.gpu for step in wanted):
        expected = f"1 to {there} GPUs of this machine" if there else "a machine with a GPU"
        raise BadInput("--gpus", expected, str(gpus), "`--only` does what needs none.")
    seconds = None if options.minutes is None else 60 * options.minutes
    runner = Runner(wanted, Places(gpus, options.each, options.jobs), options.out / "logs", seconds)
    whole = runner.run({step.name for step in steps if step.done.exists()})
    if runner.failed:
        raise SystemExit(f"failed: {', '.join(runner.failed)}; see {options.out / 'logs'}")
    print("done" if whole else LATER, flush=True)


def begun(options: argparse.Namespace, method: Method, motions: Motions) -> list[Step]:
    """All steps of a run that is held to its settings.

    Raises:
        BadInput: if something is missing, or the run began with others.
    """
    told = motions.labels[motions.labels["split"] == "train"].groupby("cluster")["motion"].nunique()
    for cluster, names in recorded_motions(motions, method.motions).items():
        if len(names) < method.motions:
            print(
                f"cluster {cluster}: {told[cluster]} motions to learn from, all {len(names)} are recorded", flush=True
            )
    freeze(options.out, method, settings=options.settings, motions=motions.hash)
    stamps = sealed_robots(options.robots)
    if stamps:
        freeze(options.out / "robots", method, robots=stamps)
    given = {"settings": options.settings, "seed": options.seed, "motions": options.motions, "out": options.out}
    shared = [word for name, value in given.items() for word in (f"--{name}", str(value))]
    shared += ["--robots", str(options.robots)] if options.robots else []
    return Plan(options.out, motions.clusters, sorted(stamps), method, tuple(shared)).steps


def sealed_robots(folder: Path | None) -> dict[str, str]:
    """Names of the sealed robots in a folder, and the hash of each; none without a folder."""
    if folder is None:
        return {}
    files = sorted(folder.glob("*-?.json"))
    if not files:
        raise BadInput(folder, "sealed robots", "none", "Run `python -m benchmarks.study.robots`.")
    for file in files:
        read_sealed(file)
    return {file.stem: json.loads(file.read_text())["sha256"] for file in files}


def write_table(options: argparse.Namespace) -> None:
    """Write the tables of a run, as far as it is done."""
    from benchmarks.method.record import below_here, record
    from benchmarks.method.tables import figures, method_tables

    out = below_here(options.out) if options.record else options.out
    method, motions = chosen(options.settings, options.seed), read_motions(options.motions)
    stamp = freeze(options.run, method, settings=options.settings, motions=motions.hash)
    text = method_tables(options.run, method, motions, options.robots)
    write_file(out, f"<!-- method {stamp}, motions {motions.hash} -->\n\n{text}")
    print(text, end="")
    if options.record:
        run_id = record(options.run, out, method, stamp, figures(options.run, method, motions))
        print(f"run {run_id} in the registry of {Path.cwd()}", flush=True)


def write_beside(options: argparse.Namespace) -> None:
    """Write the tables of several runs beside each other."""
    from benchmarks.method.beside import beside

    text = beside(options.runs, read_motions(options.motions))
    write_file(options.out, text)
    print(text, end="")


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.method",
        description=benchmarks.method.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(required=True)
    own = commands.add_parser("run", help="train, record, correct, distil and try")
    own.add_argument("--gpus", type=int, default=1)
    own.add_argument("--each", type=int, default=2, help="trainings beside each other on a GPU")
    own.add_argument("--jobs", type=int, default=2, help="processor cores for everything else")
    own.add_argument("--minutes", type=float, help="end this call after so long")
    own.add_argument("--only", nargs="+", choices=DONE, help="these kinds of steps alone")
    own.add_argument("--out", type=Path, required=True)
    own.set_defaults(work=run)
    table = commands.add_parser("table", help="the tables of a run")
    table.add_argument("run", type=Path)
    table.add_argument("--out", type=Path, required=True, help="Markdown file")
    table.add_argument("--record", action="store_true", help="write them into the registry too, with all hashes")
    table.set_defaults(work=write_table)
    runs = commands.add_parser("beside", help="base policy and experts of several runs, by learner and seed")
    runs.add_argument("runs", type=Path, nargs="+")
    runs.add_argument("--out", type=Path, required=True, help="Markdown file")
    runs.add_argument("--motions", type=Path, required=True, help="folder of `benchmarks.study prepare`")
    runs.set_defaults(work=write_beside)
    for part in (own, table):
        part.add_argument("--motions", type=Path, required=True, help="folder of `benchmarks.study prepare`")
        part.add_argument("--robots", type=Path, help="folder of `benchmarks.study.robots`")
        part.add_argument("--settings", choices=NAMED, default="world_model", help="learner and budgets")
        part.add_argument("--seed", type=int, default=0, help="of all trainings; a run of its own each")
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> None:
    """Run a command; bad input is one line and status 2."""
    options = parse(arguments)
    raise SystemExit(guarded(lambda: options.work(options)))


if __name__ == "__main__":
    main()
