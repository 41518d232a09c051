"""The filter of H2O: motions that a policy cannot follow in the declared simulator, without noise, are dropped.

H2O (He et al. 2024, "sim-to-data") trains a privileged imitator without randomisation and leaves out what it cannot
follow. Its release tests this by the mean distance of all tracked bodies from their references, in the world: an
episode fails at the first frame at which it exceeds 0.5 m (LeCAR-Lab/human2humanoid, `max_ref_motion_distance`, in its
mode for evaluation). Here the bodies are `KEY_BODIES`, and a fall by the rule of our evaluation fails, too. The policy
is an exported one; what it reads are the true values, which is all the privilege that it gets.
"""

import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from bumblebee.evaluation.contract import StartNoise
from bumblebee.evaluation.metrics import key_errors
from bumblebee.learning.export import export_shipped
from bumblebee.measured.rollout import Rollout
from bumblebee.motion.clip import Clip
from bumblebee.motion.filters.rules import row_of
from bumblebee.motion.filters.worst import Worst
from bumblebee.motion.kinematics import forward_key_positions
from bumblebee.policy.episodes import Episode, run_episodes
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.policy.robots import NominalRobots
from bumblebee.ranges import Count, Few, Line, Range, Ranged
from bumblebee.robot.sensors import NO_NOISE
from tasks.settings.filter_files import SHIPPED

RULE = "policy"


@dataclass(frozen=True)
class PolicyFilter(Ranged):
    """Which policy must be able to follow a motion, and how well."""

    source: Line = ""
    """Nothing: no such filter. "shipped": the policy that comes with BumbleBee, which has seen most of the shared
    motions. Else the folder of an exported policy (`policy.onnx` and `contract.json`)."""
    distance: Annotated[float, Range(above=0, most=100)] = 0.5
    """How far the key bodies may be from the reference, in their mean, at any time [m]."""
    at_once: Count = 64
    """Motions that are simulated side by side."""
    threads: Few = 2
    """CPU threads of the simulation."""


@contextmanager
def loaded(config: PolicyFilter) -> Iterator[ExportedPolicy]:
    """The policy."""
    if config.source != SHIPPED:
        yield ExportedPolicy.load(Path(config.source))
        return
    with tempfile.TemporaryDirectory() as scratch:
        yield ExportedPolicy.load(export_shipped(Path(scratch) / "shipped"))


def unfollowed(
    policy: ExportedPolicy,
    clips: Sequence[Clip],
    config: PolicyFilter,
    on_tick: Callable[[int], None] = lambda ended: None,
) -> dict[str, dict[str, object]]:
    """The clips that the policy cannot follow, by name, each as a row of `DROP_COLUMNS`.

    Args:
        policy: what is run.
        clips: with distinct names, 50 frames a second.
        config: see `PolicyFilter`.
        on_tick: told how many robot ticks were simulated.
    """
    by_name = {clip.name: clip for clip in clips}
    planned = [Episode(name, RULE, name, seed=0) for name in by_name]  # without noise a seed decides nothing
    rollouts = run_episodes(
        lambda count: NominalRobots(count, config.threads),
        planned,
        {RULE: policy},
        by_name,
        NO_NOISE,
        StartNoise(joint_pos=0.0, joint_vel=0.0),
        on_tick,
    )
    found = {}
    for (name, clip), rollout in zip(by_name.items(), rollouts, strict=True):
        followed, worst = judged(rollout, clip, config.distance)
        if not followed:
            found[name] = row_of(clip, RULE, worst)
    return found


def judged(rollout: Rollout, clip: Clip, limit: float) -> tuple[bool, Worst]:
    """Whether a rollout followed its clip to the end, and its largest mean distance [m] until it failed."""
    length = min(rollout.frames, clip.frames)
    if rollout.base_pos is None or rollout.base_quat is None:
        raise TypeError("robots in simulation log where their base is")
    keys = forward_key_positions(rollout.base_pos[:length], rollout.base_quat[:length], rollout.joint_pos[:length])
    distance = key_errors(keys, clip.key_pos[:length]).mean(axis=1)
    beyond = np.flatnonzero(~(distance <= limit))  # what is no number is beyond any limit
    if len(beyond):
        frame = int(beyond[0])
        value = float(distance[frame]) if np.isfinite(distance[frame]) else np.inf
        said = f"the policy's key bodies are {value:.2f} m from the motion in their mean"
        return False, Worst(value, limit, "m", frame, said)
    frame = int(distance.argmax())
    worst = float(distance[frame])
    if length < clip.frames:
        said = f"the policy falls; until then its key bodies are at most {worst:.2f} m from the motion in their mean"
        return False, Worst(worst, limit, "m", length, said)
    return True, Worst(worst, limit, "m", frame, f"followed within {worst:.2f} m")
