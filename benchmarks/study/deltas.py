"""One delta action for each cluster against one for all, on a robot that the rounds have recorded.

    python -m benchmarks.study.deltas run study/rounds --robot robot-0 --motions study/motions --robots study/robots --out OUT
    python -m benchmarks.study.deltas table OUT --out deltas.md

Both learn from the recordings of round 1, the general one from all clusters', and act on the declared model. They are
judged by the rest of these recordings, and by what a policy is worth on the robot that trained on in either.
"""  # noqa: E501

import argparse
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import torch

from benchmarks.study.motions import Motions, read_motions
from benchmarks.study.on_robot import read_recordings
from benchmarks.study.round_settings import SMALL_CONFIG
from benchmarks.study.round_settings import RoundsConfig as Rounds
from benchmarks.study.rounds import BASE, Place, learned_from
from benchmarks.study.settings import FROZEN, SMALL, Study, freeze, frozen, sha256, take_in
from benchmarks.study.steps import Places, Runner, Step
from bumblebee.deploy.stand_in import BASES
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.learning.delta import DELTA_PPO, DeltaConfig
from bumblebee.learning.policy import FILE
from bumblebee.measured.rollout import Rollout

NONE, GENERAL, OWN = ARMS = ("none", "general", "own")
"""Without a delta action, with the one for all clusters, with the cluster's own."""
WORK = "benchmarks.study.delta_work"


@dataclass(frozen=True)
class DeltasConfig:
    """Settings that are fixed beforehand."""

    delta: DeltaConfig = field(
        default_factory=lambda: DeltaConfig(
            method="ppo", limit=0.2, num_envs=1024, ppo=replace(DELTA_PPO, iterations=1000)
        )
    )
    """Settings of a cluster's own and the general one, which thus sees a cluster a fifth as often."""
    steps: float = 5e6
    """Control steps by which the base policy trains on on a cluster's motions."""
    tries: int = 2
    """Trials of each motion of the cluster, of those recorded and of those held out from all training."""
    max_seconds: float = Rounds.max_seconds
    tried_base: str = BASES[1]
    try_seed: int = 18_950
    judge_worlds: int = 64


SMALL_DELTAS = DeltasConfig(delta=SMALL_CONFIG.delta, steps=512, tries=1, max_seconds=SMALL_CONFIG.max_seconds)
"""For tests: it shows that every step runs, and nothing else."""


def delta_folder(out: Path, arm: str, cluster: str) -> Path | None:
    """Where an arm's delta action for a cluster is."""
    return None if arm == NONE else out / f"delta-{GENERAL if arm == GENERAL else cluster}"


def plan(out: Path, clusters: list[str], shared: tuple[str, ...]) -> list[Step]:
    """All steps of a run."""
    steps = []

    def add(kind: str, what: str, done: str, needs: tuple[str, ...] = (), gpu: bool = False) -> str:
        steps.append(Step(f"{kind}/{what}", (WORK, kind, what, *shared), out / done, needs, gpu))
        return steps[-1].name

    deltas = {what: add("delta", what, f"delta-{what}", gpu=True) for what in (GENERAL, *clusters)}
    for cluster in clusters:
        needs = (deltas[GENERAL], deltas[cluster])
        add("errors", cluster, f"errors-{cluster}.csv", needs)
        for arm in ARMS:
            own = {NONE: (), GENERAL: needs[:1], OWN: needs[1:]}[arm]
            name = f"{arm}-{cluster}"
            trained = add("policy", name, f"{name}/done.json", own, gpu=True)
            add("tried", name, f"tried-{name}.csv", (trained,))
    return steps


def run(options: argparse.Namespace) -> None:
    """Do the steps, or as many as the time goes."""
    study, config = (SMALL, SMALL_DELTAS) if options.small else (Study(), DeltasConfig())
    gpus = options.gpus if study.env.engine == "mujoco_warp" else 0
    if gpus > torch.cuda.device_count():
        raise BadInput("--gpus", f"at most {torch.cuda.device_count()} GPUs of this machine", str(gpus))
    motions = read_motions(options.motions)
    clusters = begin(options, study, config, motions)
    inputs = {"--rounds": options.rounds, "--motions": options.motions, "--robots": options.robots}
    shared = [word for name, path in (inputs | {"--out": options.out}).items() for word in (name, str(path))]
    steps = plan(options.out, clusters, (*shared, *(("--small",) if options.small else ())))
    seconds = None if options.minutes is None else 60 * options.minutes
    runner = Runner(steps, Places(gpus, options.each, options.jobs), options.out / "logs", seconds)
    whole = runner.run()
    if runner.failed:
        raise SystemExit(f"failed: {', '.join(runner.failed)}; see {options.out / 'logs'}")
    print("done" if whole else "the call is over: the same command goes on", flush=True)


def begin(options: argparse.Namespace, study: Study, config: DeltasConfig, motions: Motions) -> list[str]:
    """Hold the run to its settings, take the base policy in; the clusters that can have a delta action of their own.

    Raises:
        BadInput: if the rounds have no recordings of the robot, or the run began with others.
    """
    folder = options.rounds / Place(options.robot, BASE, 1).name
    if not list(folder.glob("record-*")):
        raise BadInput(folder, "recordings of the robot", "none", "Run `benchmarks.study.rounds run` first.")
    recorded = frozen(options.rounds)["recorded"]
    clusters = clusters_with_episodes(read_recordings(folder), recorded, motions, config.delta.episode_seconds)
    inputs = {"motions": motions.hash, "robot": options.robot, "recorded": recorded, "clusters": clusters}
    freeze(options.out, study, deltas=asdict(config), **inputs, base=sha256(options.rounds / BASE / FILE))
    take_in(options.rounds / BASE, options.out / BASE)
    for cluster in sorted(set(motions.clusters) - set(clusters)):
        print(f"{cluster}: left out, none of its recordings is longer than an episode", flush=True)
    return clusters


def clusters_with_episodes(
    rollouts: Sequence[Rollout], recorded: Sequence[str], motions: Motions, seconds: float
) -> list[str]:
    """Clusters of which a recording to learn from is longer than `seconds`."""
    cluster_of, learned = motions.labels.set_index("name")["cluster"], learned_from(recorded)
    names = {own.meta["motion"] for own in rollouts if own.duration > seconds}
    return sorted({cluster_of[name] for name in names & set(learned)})


def write_table(options: argparse.Namespace) -> None:
    """Write the tables of a run that is done."""
    from benchmarks.study.delta_tables import deltas_tables

    text = deltas_tables(options.run)
    stamp = sha256(options.run / FROZEN)[:12]
    options.out.write_text(f"<!-- deltas {stamp} -->\n\n{text}")
    print(text, end="")


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(prog="benchmarks.study.deltas", description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(required=True)
    own = commands.add_parser("run", help="train, judge, train on and try")
    own.add_argument("rounds", type=Path, help="folder of a run of `benchmarks.study.rounds`")
    own.add_argument("--robot", required=True, help="name of its sealed file")
    own.add_argument("--motions", type=Path, required=True)
    own.add_argument("--robots", type=Path, required=True, help="folder of `benchmarks.study.robots`")
    own.add_argument("--gpus", type=int, default=1)
    own.add_argument("--each", type=int, default=2, help="trainings beside each other on a GPU")
    own.add_argument("--jobs", type=int, default=2, help="processor cores for everything else")
    own.add_argument("--minutes", type=float, help="end this call after so long")
    own.add_argument("--small", action="store_true", help="the same in seconds on two cores: shows that it runs")
    own.add_argument("--out", type=Path, required=True)
    own.set_defaults(work=run)
    table = commands.add_parser("table", help="the tables of a run")
    table.add_argument("run", type=Path)
    table.add_argument("--out", type=Path, required=True, help="Markdown file")
    table.set_defaults(work=write_table)
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
