"""Rounds on sealed robots: record, correct the simulator, train on, try; each arm corrects in its own way.

    python -m benchmarks.study.rounds run study/run/s0-base --motions study/motions --robots study/robots --out OUT
    python -m benchmarks.study.rounds table OUT --robots study/robots --out rounds.md

`run` may be ended at any time and goes on; `--only record diagnosis` does what needs no GPU. From the same base policy
each robot's arms start: `physics` corrects the declared model by the diagnosis, `delta` by a delta action, `both` by a
delta action on what the diagnosis leaves, `none` not at all; all train on by equal steps and are tried on the robot.
The first round's recordings are the base policy's and shared; later rounds record each arm's own policy.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import torch

from benchmarks.study.motions import Motions, read_motions
from benchmarks.study.robots import DECLARED
from benchmarks.study.round_settings import RoundsConfig, add_settings, settings
from benchmarks.study.settings import FROZEN, Study, freeze, sha256, take_in
from benchmarks.study.steps import Places, Runner, Step
from bumblebee.deploy.stand_in_effects import read_sealed
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.evaluation.thinning import thin
from bumblebee.learning.policy import FILE

BASE = "base"
"""The arm of what all arms share: the base policy, the recordings of round 1 and their diagnosis."""
ARMS = {"none": (), "physics": ("diagnosis",), "delta": ("delta",), "both": ("diagnosis", "delta")}
"""Corrections of the simulator in each arm. The longest way is the last and goes first."""
KINDS = ("tried", "record", "diagnosis", "delta", "errors", "policy")
WORK = "benchmarks.study.round_work"


@dataclass(frozen=True)
class Place:
    """An arm's round on a robot; names of steps and folders follow from it."""

    robot: str
    arm: str
    round: int

    @property
    def name(self) -> str:
        """As in names of steps, and the folder below the run's."""
        return f"{self.robot}/{self.arm}/r{self.round}"

    @property
    def recorded(self) -> "Place":
        """Where this round's recordings are: the first round's are shared."""
        return Place(self.robot, BASE, 1) if self.round == 1 else self

    @property
    def before(self) -> str:
        """Folder of the policy that the round starts from, below the run's."""
        return BASE if self.round == 1 else Place(self.robot, self.arm, self.round - 1).policy

    @property
    def policy(self) -> str:
        """Folder of the round's policy, below the run's."""
        return BASE if self.arm == BASE else f"{self.name}/policy"

    @classmethod
    def of(cls, text: str) -> "Place":
        """From its name."""
        robot, arm, round_ = text.split("/")
        return cls(robot, arm, int(round_[1:]))


def recorded_motions(motions: Motions, followed: Sequence[str], config: RoundsConfig) -> list[str]:
    """Names of the training motions that are recorded: of each cluster first those that the base policy follows.

    Args:
        motions: the study's.
        followed: names of those that it follows on the declared robot.
        config: how many.
    """
    train = motions.labels[motions.labels["split"] == "train"]
    each, chosen = config.motions // len(motions.clusters), []
    for cluster in motions.clusters:
        own = train[train["cluster"] == cluster]
        first = [name for name in followed if name in set(own["name"])]
        chosen += [*first, *thin(own[~own["name"].isin(first)], each)][:each]
    return chosen


def learned_from(recorded: Sequence[str]) -> list[str]:
    """Every second of the recorded motions: a correction learns from their recordings; the others judge it."""
    return list(recorded[::2])


def plan(out: Path, robots: Sequence[str], config: RoundsConfig, shared: tuple[str, ...]) -> list[Step]:
    """All steps of a run, those that others wait for first.

    Args:
        out: the run's folder.
        robots: names of the sealed files.
        config: what the rounds fix.
        shared: arguments of every step.
    """
    steps: list[Step] = []

    def add(place: Place, kind: str, needs: Sequence[str] = (), gpu: bool = False, shard: int = 0) -> str:
        many = kind in ("record", "tried")
        own = f"{kind}-{shard}" if many else kind
        done = out / place.name / (f"{own}.csv" if kind in ("tried", "errors") else own)
        if kind == "policy":
            done = done / "done.json"
        command = (WORK, kind, place.name, *shared, *(("--shard", str(shard)) if many else ()))
        steps.append(Step(f"{place.name}/{own}", command, done, tuple(needs), gpu))
        return steps[-1].name

    def shards(place: Place, kind: str, needs: Sequence[str]) -> list[str]:
        return [add(place, kind, needs, shard=shard) for shard in range(config.shards)]

    recorded: dict[Place, list[str]] = {}
    diagnosed: dict[Place, str] = {}
    trained: dict[Place, str] = {}
    deltas: dict[str, list[str]] = {robot: [] for robot in robots}
    for robot in robots:
        place = Place(robot, BASE, 1)
        recorded[place] = shards(place, "record", ())
    for robot in robots:
        place = Place(robot, BASE, 1)
        diagnosed[place] = add(place, "diagnosis", recorded[place])
    for round_ in range(1, config.rounds + 1):
        places = [Place(robot, arm, round_) for arm in reversed(ARMS) for robot in reversed(robots)]
        for place in places if round_ > 1 else []:
            if ARMS[place.arm]:
                needs = [trained[Place(place.robot, place.arm, round_ - 1)]]
                recorded[place] = shards(place, "record", needs)
                if "diagnosis" in ARMS[place.arm]:
                    diagnosed[place] = add(place, "diagnosis", recorded[place])
        for place in places:
            needs = [trained[Place(place.robot, place.arm, round_ - 1)]] if round_ > 1 else []
            if "diagnosis" in ARMS[place.arm]:
                needs.append(diagnosed[place.recorded])
            if "delta" in ARMS[place.arm]:
                by_ppo = config.delta.method == "ppo"
                needs = [add(place, "delta", [*needs, *recorded[place.recorded]], gpu=by_ppo)]
                if round_ == 1:
                    deltas[place.robot].append(needs[0])
            trained[place] = add(place, "policy", needs, gpu=True)
    for robot in robots:
        shards(Place(robot, BASE, 0), "tried", ())
        place = Place(robot, BASE, 1)
        add(place, "errors", [diagnosed[place], *deltas[robot]])
    for place, policy in trained.items():
        shards(place, "tried", [policy])
    return steps


def begin(options: argparse.Namespace, study: Study, config: RoundsConfig, motions: Motions) -> list[str]:
    """Hold the run to its settings, take the base policy in; names of the robots.

    Raises:
        BadInput: if something is missing, or the run began with others.
    """
    robots = sorted(path.stem for path in options.robots.glob("*.json") if path.name == DECLARED or "-" in path.stem)
    if not robots:
        raise BadInput(options.robots, "sealed robots", "none", "Run `benchmarks.study.robots`.")
    stamps = {}
    for name in robots:
        read_sealed(options.robots / f"{name}.json")
        stamps[name] = json.loads((options.robots / f"{name}.json").read_text())["sha256"]
    followed = json.loads((options.robots / "followed.json").read_text())["names"]
    recorded = recorded_motions(motions, followed, config)
    inputs = {"motions": motions.hash, "robots": stamps, "recorded": recorded, "base": sha256(options.base / FILE)}
    freeze(options.out, study, rounds=asdict(config), **inputs)
    take_in(options.base, options.out / BASE)
    return robots


def run(options: argparse.Namespace) -> None:
    """Do the steps, or as many as the time goes."""
    study, config = settings(options)
    gpus = options.gpus if study.env.engine == "mujoco_warp" else 0
    if gpus > torch.cuda.device_count() and not options.only:
        raise BadInput("--gpus", f"at most {torch.cuda.device_count()} GPUs of this machine", str(gpus))
    motions = read_motions(options.motions)
    robots = begin(options, study, config, motions)
    shared = ("--motions", str(options.motions), "--robots", str(options.robots), "--out", str(options.out))
    chosen = [f"--{name}" for name in ("small", "regression") if getattr(options, name)]
    steps = plan(options.out, robots, config, (*shared, *chosen))
    kinds = options.only or KINDS
    wanted = [step for step in steps if step.name.rsplit("/", 1)[1].split("-")[0] in kinds]
    seconds = None if options.minutes is None else 60 * options.minutes
    runner = Runner(wanted, Places(gpus, options.each, options.jobs), options.out / "logs", seconds)
    whole = runner.run({step.name for step in steps if step.done.exists()})
    if runner.failed:
        raise SystemExit(f"failed: {', '.join(runner.failed)}; see {options.out / 'logs'}")
    print("done" if whole else "the call is over: the same command goes on", flush=True)


def write_table(options: argparse.Namespace) -> None:
    """Write the tables of a run that is done."""
    from benchmarks.study.round_tables import rounds_tables

    config = settings(options)[1]
    text = rounds_tables(options.run, options.robots, config)
    stamp = sha256(options.run / FROZEN)[:12]
    options.out.write_text(f"<!-- rounds {stamp} -->\n\n{text}")
    print(text, end="")


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(prog="benchmarks.study.rounds", description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(required=True)
    own = commands.add_parser("run", help="record, correct, train on and try")
    own.add_argument("base", type=Path, help="folder of the base policy")
    own.add_argument("--motions", type=Path, required=True)
    own.add_argument("--only", nargs="+", choices=KINDS, help="these kinds of steps alone")
    own.add_argument("--gpus", type=int, default=1)
    own.add_argument("--each", type=int, default=2, help="trainings beside each other on a GPU")
    own.add_argument("--jobs", type=int, default=2, help="processor cores for everything else")
    own.add_argument("--minutes", type=float, help="end this call after so long")
    own.add_argument("--out", type=Path, required=True)
    own.set_defaults(work=run)
    table = commands.add_parser("table", help="the tables of a run")
    table.add_argument("run", type=Path)
    table.add_argument("--out", type=Path, required=True, help="Markdown file")
    table.set_defaults(work=write_table)
    for part in (own, table):
        part.add_argument("--robots", type=Path, required=True, help="folder of `benchmarks.study.robots`")
        add_settings(part)
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
