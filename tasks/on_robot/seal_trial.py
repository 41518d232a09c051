"""Whether a drawn robot is worth sealing: what the shipped policy loses on it, tried before the loop starts.

The trial runs on the stand-in robot in its own process, with seeds that no later stage uses. What comes back is how
long each motion was followed: nothing that is said of a drawn robot names an effect.
"""

import json
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bumblebee.evaluation.episodes import rollout_metrics
from bumblebee.measured.rollout import Rollout, read_rollout
from bumblebee.motion.clip import Clip
from bumblebee.motion.store import write_library
from bumblebee.policy.episodes import Episode, run_episodes
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import NominalRobots
from bumblebee.robot.sensors import NO_NOISE
from bumblebee.tracking.terminations import success_threshold
from tasks.on_robot.stand_in import start_stand_in

KEY = "shipped"


@dataclass(frozen=True)
class Trial:
    """The shipped policy on a drawn robot."""

    lost: float
    """Share of the motions which it follows on the declared model and not on this robot."""
    seconds: float
    """Median time that it follows a motion [s]: a robot that falls at once gives no data."""


def followed(policy: Path, clips: Sequence[Clip], seed: int, threads: int) -> list[Clip]:
    """The clips that an exported policy follows to the end on the declared model."""
    policies = {KEY: ExportedPolicy.load(policy)}
    by_name = {clip.name: clip for clip in clips}
    planned = episodes(clips, seed)
    rollouts = run_episodes(lambda n: NominalRobots(n, threads), planned, policies, by_name, NO_NOISE)
    return [clip for clip, rollout in zip(clips, rollouts, strict=True) if to_the_end(clip, rollout)]


def try_robot(policy: Path, sealed: dict[str, Any], clips: Sequence[Clip], seed: int, threads: int) -> Trial:
    """An exported policy on these clips on a robot with this content of a sealed file."""
    planned = [
        {"rollout_id": e.rollout_id, "policy": KEY, "motion": e.motion, "seed": seed} for e in episodes(clips, seed)
    ]
    plan = {"policies": {KEY: str(policy.resolve())}, "episodes": planned, "judged": True}
    with tempfile.TemporaryDirectory() as scratch:
        work = Path(scratch)
        write_library(work / "clips", list(clips))
        (work / "robot.json").write_text(json.dumps(sealed))
        start_stand_in(plan, work / "clips", work / "rollouts", work, threads, work / "robot.json")
        rollouts = [read_rollout(work / "rollouts" / f"{episode['rollout_id']}.parquet") for episode in planned]
    ends = [to_the_end(clip, rollout) for clip, rollout in zip(clips, rollouts, strict=True)]
    return Trial(1.0 - float(np.mean(ends)), float(np.median([rollout.duration for rollout in rollouts])))


def episodes(clips: Sequence[Clip], seed: int) -> list[Episode]:
    """One for each clip."""
    return [Episode(clip.name, KEY, clip.name, seed) for clip in clips]


def to_the_end(clip: Clip, rollout: Rollout) -> bool:
    """Success by the paper's thresholds."""
    return rollout_metrics(rollout, clip, success_threshold(clip)).success
