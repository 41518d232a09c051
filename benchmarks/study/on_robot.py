"""Runs a policy on a sealed robot, which is a process of its own."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

from bumblebee.deploy.episodes import Episode
from bumblebee.learning.export import export_policy
from bumblebee.learning.policy import load_policy
from bumblebee.measured.rollout import Rollout, read_rollout
from bumblebee.motion.clip import Clip
from bumblebee.motion.store import write_library
from tasks.stand_in import start_stand_in

KEY = "policy"


def exported(policy: Path, folder: Path) -> Path:
    """The policy of a study's folder as robots run it, in `folder`, a new one."""
    folder.mkdir(parents=True)
    export_policy(folder, load_policy(policy))
    return folder


def run_on_robot(
    policy: Path, robot: Path, clips: Sequence[Clip], episodes: Sequence[Episode], base: str, judged: bool, threads: int
) -> list[Rollout]:
    """One measured rollout for each episode.

    Args:
        policy: folder of an exported policy.
        robot: sealed file.
        clips: the motions that episodes name.
        episodes: what is run; their key of the policy is `KEY`.
        base: what the robot knows of its base's place, one of `stand_in.BASES`.
        judged: whether rollouts hold the true state in place of readings.
        threads: cores.
    """
    planned = [
        {"rollout_id": e.rollout_id, "policy": KEY, "motion": e.motion, "seed": e.seed, "meta": dict(e.meta)}
        for e in episodes
    ]
    plan = {"policies": {KEY: str(policy.resolve())}, "episodes": planned, "base": base, "judged": judged}
    with tempfile.TemporaryDirectory() as scratch:
        work = Path(scratch)
        write_library(work / "clips", list(clips))
        start_stand_in(plan, work / "clips", work / "rollouts", work, threads, robot)
        return [read_rollout(work / "rollouts" / f"{e.rollout_id}.parquet") for e in episodes]
