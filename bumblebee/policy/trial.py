"""How well an exported policy follows motions on the declared model, through the runner that a robot has."""

import math
from collections.abc import Sequence
from dataclasses import astuple, replace

import pandas as pd

from bumblebee.evaluation.contract import StartNoise
from bumblebee.evaluation.episodes import rollout_metrics
from bumblebee.measured.rollout import Rollout
from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import make_clip
from bumblebee.policy.episodes import Episode, run_episodes
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import NominalRobots
from bumblebee.robot.sensors import NO_NOISE, SensorNoise
from bumblebee.tracking.terminations import FALL, Stop, success_threshold

_NEVER = Stop(tilt_deg=180.0, drop_m=math.inf)


def try_exported(
    policy: ExportedPolicy, clips: Sequence[Clip], repeats: int = 1, noise: float = 0.0, seed: int = 0, threads: int = 2
) -> pd.DataFrame:
    """Roll out each clip from its first frame; observation, history and memory are the runner's.

    Args:
        policy: the exported policy.
        clips: the motions, 50 Hz.
        repeats: rollouts of each.
        noise: factor on `StartNoise` and `SensorNoise`.
        seed: seed of that noise.
        threads: CPU threads of the physics.

    Returns:
        The columns of `bumblebee.learning.trial.try_policy`, a row a rollout.
    """
    every = [(clip, seed + draw) for clip in clips for draw in range(repeats)]
    start = StartNoise(*(noise * size for size in astuple(StartNoise())))
    sizes = {name: noise * size for name, size in vars(SensorNoise()).items() if isinstance(size, float)}
    readings = SensorNoise(**sizes)  # type: ignore[arg-type]
    rollouts = _run(policy, every, threads, FALL, readings, start)
    rows = []
    for (clip, _), rollout in zip(every, rollouts, strict=True):
        found = rollout_metrics(rollout, clip, success_threshold(clip))
        share = 1.0 if found.success else found.frames / clip.frames
        about = {"name": clip.name, "family": clip.family, "split": clip.split, "success": found.success}
        rows.append(about | {"share": share, "key_error": found.mpkpe_mm / 1000, "joint_error": found.mpjpe_rad})
    return pd.DataFrame(rows)


def follow_exported(policy: ExportedPolicy, clip: Clip) -> Clip:
    """The motion (T frames) of a robot that follows `clip` (T frames) without noise, a fall included."""
    (done,) = _run(policy, [(clip, 0)], 1, _NEVER, NO_NOISE, StartNoise(0.0, 0.0))
    assert done.base_pos is not None and done.base_quat is not None
    return make_clip(clip.name, clip.fps, done.base_pos, done.base_quat, done.joint_pos, family=clip.family)


def _run(
    policy: ExportedPolicy,
    every: Sequence[tuple[Clip, int]],
    threads: int,
    stop: Stop,
    readings: SensorNoise,
    start: StartNoise,
) -> list[Rollout]:
    """True states of one rollout for each clip and seed."""
    named = {str(i): replace(clip, name=str(i)) for i, (clip, _) in enumerate(every)}  # two may have one name
    episodes = [Episode(name, "policy", name, seed) for name, (_, seed) in zip(named, every, strict=True)]
    made = {"policy": policy}
    return run_episodes(
        lambda n: NominalRobots(n, min(threads, n)), episodes, made, named, readings, start, stop=stop, judged=True
    )
