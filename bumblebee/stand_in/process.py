"""The stand-in robot, a process of its own: runs exported policies and writes measured rollouts by the contract.

    python -m bumblebee.stand_in.process --sealed data/sealed/robot.json --policy DIR --clips LIBRARY \
        --names squat_01 squat_02 --rollouts 2 --seed 1 --out DIR
    python -m bumblebee.stand_in.process --sealed data/sealed/robot.json --clips LIBRARY --plan plan.json --out DIR

It takes the robot's place: its effects are sealed in a file that nothing else reads before the loop's report.
A plan is {"policies": {key: folder}, "episodes": [{"rollout_id", "policy", "motion", "seed", "meta"}],
"start_noise": {...}, "base": ..., "stop": {...}, "compensations": {key: compensation.json}}; meta and all from
start_noise on may be absent. `stop` is when an episode ends before its clip does (`terminations.Stop`).
`judged`: the rollouts hold the true state in place of readings, for the evaluation.

`base` says what the robot knows of its base's place: `mocap`, 1 mm of noise; `odometry`, which drifts, for the policy
as for the log; `none`, odometry for the policy and no `base_pos` in the log.
"""

import argparse
import json
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import mujoco

from bumblebee.compensation.file import load_compensations
from bumblebee.compensation.numbers import Compensation
from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.evaluation.contract import StartNoise
from bumblebee.measured.rollout import Rollout, write_rollout
from bumblebee.motion.clip import Clip
from bumblebee.motion.store import read_library
from bumblebee.policy.episodes import Episode, run_episodes
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import SideBySide
from bumblebee.progress import progress
from bumblebee.robot.sensors import SensorNoise
from bumblebee.stand_in.body import StandInRobots
from bumblebee.stand_in.sealed import Json, read_sealed
from bumblebee.tracking.terminations import FALL, Stop

BASES = ("mocap", "odometry", "none")


@dataclass(frozen=True)
class Work:
    """Work of the stand-in robot: what is run."""

    policies: dict[str, Path]
    """Key -> folder."""
    episodes: list[Episode]
    start: StartNoise
    base: str
    """One of `BASES`."""
    undone: dict[str, Compensation]
    """By the keys of policies."""
    stop: Stop = FALL
    judged: bool = False


@dataclass(frozen=True)
class Play:
    """The work that a robot gets."""

    work: Work
    policies: dict[str, ExportedPolicy]
    """By the keys of the work."""
    clips: dict[str, Clip]
    """By name."""
    effects: list[Json]
    """Entries of the sealed file."""
    threads: int
    tick: Callable[[int], None]
    """Told how many robot ticks were done since the last time."""


def side_by_side(play: Play) -> list[Rollout]:
    """All episodes at once, the policy's command held for each control period."""
    work, effects = play.work, play.effects
    make = lambda count: SideBySide(lambda part: StandInRobots(part, effects), count, play.threads)  # noqa: E731
    noise = SensorNoise(base="mocap" if work.base == "mocap" else "odometry")
    given = (work.episodes, play.policies, play.clips, noise, work.start, play.tick, work.undone, work.stop)
    return run_episodes(make, *given, work.judged)


def main(argv: list[str] | None = None, robot: Callable[[Play], list[Rollout]] = side_by_side) -> int:
    """Run the process; returns its exit status."""
    options = _options(argv)
    mujoco.set_mju_user_warning(lambda text: None)  # a robot that falls apart is a fall, not a log file
    try:
        run(options, robot)
    except BadInput as error:
        print(error, file=sys.stderr, flush=True)
        return EXIT_BAD_INPUT
    return 0


def run(options: argparse.Namespace, robot: Callable[[Play], list[Rollout]]) -> None:
    """Run all episodes and write one file each."""
    effects = read_sealed(options.sealed) if options.sealed else []
    work = _plan(options) if options.plan else _named(options)
    episodes = work.episodes
    if not episodes:
        raise BadInput(options.plan or "--names", "at least one episode", "none")
    policies = {key: ExportedPolicy.load(folder) for key, folder in work.policies.items()}
    clips = {clip.name: clip for clip in read_library(options.clips, sorted({e.motion for e in episodes}))}
    existing = [e.rollout_id for e in episodes if (options.out / f"{e.rollout_id}.parquet").exists()]
    if existing:
        raise BadInput(options.out / f"{existing[0]}.parquet", "a new file", "one that exists", "Choose another --out.")
    total = sum(clips[e.motion].frames for e in episodes)
    recorded = {"recorded_at": datetime.now(UTC).isoformat(timespec="seconds"), "operator": options.operator}
    parent = os.getppid()
    with progress(total, f"stand-in robot, {len(episodes)} rollouts", "ticks") as bar:

        def tick(count: int) -> None:
            if options.with_parent and os.getppid() != parent:
                raise SystemExit(1)
            bar.update(count)

        rollouts = robot(Play(work, policies, clips, effects, options.threads, tick))
    for rollout in rollouts if work.base != "none" else [replace(rollout, base_pos=None) for rollout in rollouts]:
        rollout.meta.update({key: value for key, value in recorded.items() if key not in rollout.meta})
        ending = _ending(rollout.frames, clips[rollout.meta["motion"]])
        rollout.meta["notes"] = "; ".join(filter(None, (ending, str(rollout.meta.get("notes", "")))))
        write_rollout(options.out / f"{rollout.rollout_id}.parquet", rollout)


def _ending(frames: int, clip: Clip) -> str:
    return (
        "ran to the end" if frames >= clip.frames else f"fell after {frames / clip.fps:.2f} s of {clip.duration:.2f} s"
    )


def _named(options: argparse.Namespace) -> Work:
    """Every named clip, `--rollouts` times, by one policy."""
    if not options.policy or not options.names:
        raise BadInput("command line", "--policy and --names, or --plan", "neither")
    key = options.policy_name or options.policy.name
    meta = {"cluster": options.cluster} if options.cluster else {}
    episodes = [
        Episode(f"{options.prefix}{name}-{run}", key, name, options.seed + run, dict(meta))
        for name in options.names
        for run in range(options.rollouts)
    ]
    return Work({key: options.policy}, episodes, StartNoise(), options.base or BASES[0], {})


def _plan(options: argparse.Namespace) -> Work:
    try:
        plan = json.loads(options.plan.read_text())
        policies = {key: Path(folder) for key, folder in plan["policies"].items()}
        episodes = [Episode(**episode) for episode in plan["episodes"]]
        start, base = StartNoise(**plan.get("start_noise", {})), options.base or plan.get("base", BASES[0])
        stop, judged = Stop(**plan.get("stop", {})), bool(plan.get("judged", False))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise BadInput(options.plan, "a plan with policies and episodes", f"{type(error).__name__}: {error}") from None
    if base not in BASES:
        raise BadInput(f"{options.plan}: base", f"one of {', '.join(BASES)}", str(base)[:40])
    return Work(policies, episodes, start, base, load_compensations(plan, options.plan), stop, judged)


def _options(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m bumblebee.stand_in.process", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("--sealed", type=Path, help="file of undeclared effects; without it there are none")
    parser.add_argument("--clips", type=Path, required=True, help="motion library")
    parser.add_argument("--out", type=Path, required=True, help="folder for the rollouts")
    parser.add_argument("--plan", type=Path, help="JSON file of policies and episodes")
    parser.add_argument("--policy", type=Path, help="policy folder, where there is no plan")
    parser.add_argument("--policy-name", default="", help="its name in the rollouts' metadata")
    parser.add_argument("--names", nargs="+", default=[], help="clips to run")
    parser.add_argument("--rollouts", type=int, default=1, help="rollouts of each clip")
    parser.add_argument("--cluster", default="", help="cluster, for the metadata")
    parser.add_argument("--prefix", default="", help="of the rollouts' names")
    parser.add_argument("--seed", type=int, default=0, help="of start states and sensor noise")
    parser.add_argument("--base", choices=BASES, help="what it knows of its base's place; mocap, or as the plan says")
    parser.add_argument("--threads", type=int, default=2, help="of the simulation")
    parser.add_argument("--with-parent", action="store_true", help="end when the process that started it is gone")
    parser.add_argument("--operator", default="stand-in", help="for the metadata")
    return parser.parse_args(argv)


if __name__ == "__main__":
    raise SystemExit(main())
