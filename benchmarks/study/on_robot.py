"""Runs a policy on a sealed robot, which is a process of its own."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from bumblebee.evaluation.episodes import rollout_metrics
from bumblebee.io import left_overs
from bumblebee.io.whole import put
from bumblebee.learning.export import export_policy
from bumblebee.learning.policy import load_policy
from bumblebee.measured.rollout import Rollout, read_rollout, rollout_files
from bumblebee.motion.clip import Clip
from bumblebee.motion.store import write_library
from bumblebee.policy.episodes import Episode
from bumblebee.tracking.terminations import success_threshold
from tasks.on_robot.stand_in import start_stand_in

KEY = "policy"


def exported(policy: Path, folder: Path) -> Path:
    """The policy of a folder as robots run it, in `folder`, a new one."""
    folder.mkdir(parents=True)
    export_policy(folder, load_policy(policy))
    return folder


def run_on_robot(
    policy: Path, robot: Path, clips: Sequence[Clip], episodes: Sequence[Episode], base: str, judged: bool, threads: int
) -> list[Rollout]:
    """One policy's measured rollouts, see `run_policies_on_robot`; the episodes' key of the policy is `KEY`."""
    return run_policies_on_robot({KEY: policy}, robot, clips, episodes, base, judged, threads)


def run_policies_on_robot(
    policies: Mapping[str, Path],
    robot: Path,
    clips: Sequence[Clip],
    episodes: Sequence[Episode],
    base: str,
    judged: bool,
    threads: int,
) -> list[Rollout]:
    """One measured rollout for each episode.

    Args:
        policies: key -> folder of an exported policy.
        robot: sealed file.
        clips: the motions that episodes name.
        episodes: what is run.
        base: what the robot knows of its base's place, one of `stand_in.BASES`.
        judged: whether rollouts hold the true state in place of readings.
        threads: cores.
    """
    planned = [
        {"rollout_id": e.rollout_id, "policy": e.policy, "motion": e.motion, "seed": e.seed, "meta": dict(e.meta)}
        for e in episodes
    ]
    folders = {key: str(folder.resolve()) for key, folder in policies.items()}
    plan = {"policies": folders, "episodes": planned, "base": base, "judged": judged}
    with tempfile.TemporaryDirectory() as scratch:
        work = Path(scratch)
        write_library(work / "clips", list(clips))
        start_stand_in(plan, work / "clips", work / "rollouts", work, threads, robot)
        return [read_rollout(work / "rollouts" / f"{e.rollout_id}.parquet") for e in episodes]


def read_recordings(folder: Path) -> list[Rollout]:
    """All rollouts in a folder's `record-*`."""
    return [read_rollout(file) for part in sorted(folder.glob("record-*")) for file in rollout_files(part)]


def judged_rows(rollouts: Sequence[Rollout], clips: Sequence[Clip], held_out: Sequence[str]) -> pd.DataFrame:
    """A row a judged rollout: name, set, seed, success, seconds, mpkpe_mm.

    Args:
        rollouts: `<motion>-<seed>` each, of the true state.
        clips: the motions that were followed.
        held_out: names of those that no training has seen.
    """
    by_name, rows = {clip.name: clip for clip in clips}, []
    for rollout in rollouts:
        clip = by_name[rollout.meta["motion"]]
        found = rollout_metrics(rollout, clip, success_threshold(clip))
        which = "held out" if clip.name in held_out else "recorded"
        row = {"name": clip.name, "set": which, "seed": int(rollout.rollout_id.rsplit("-", 1)[1])}
        rows.append(row | {"success": found.success, "seconds": rollout.duration, "mpkpe_mm": found.mpkpe_mm})
    return pd.DataFrame(rows)


def write_csv(path: Path, table: pd.DataFrame) -> None:
    """Write a table whole or not at all."""
    if path.parent.is_dir():
        left_overs.clear(path)
    put(path, table.to_csv(index=False).encode())
