"""A run sheet: motions in the order of their risk, from simulation on robots that differ, with what to watch.

Each motion is followed by the policy on robots drawn from a randomisation. A robot that leans or sinks beyond the
guard's limits has fallen; one on which another rule would have damped is counted apart. Rows are at 50 Hz: a peak
between two of them, which the guard's 200 Hz would see, is not in them.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from bumblebee.evaluation.contract import clip_digest
from bumblebee.evaluation.intervals import wilson
from bumblebee.measured.rollout import Rollout
from bumblebee.motion.clip import Clip
from bumblebee.policy.episodes import Episode, run_episodes
from bumblebee.policy.exported import ExportedPolicy
from bumblebee.robot.sensors import SensorNoise
from bumblebee.tracking.presets import PAPER_RANDOMISATION
from bumblebee.tracking.terminations import Stop
from bumblebee.wire.robot_end.drawn_robots import DrawnRobots
from bumblebee.wire.safety.limits import Drives, Limits, drives_of
from bumblebee.wire.safety.uses import DAMPING, Measured, Use, room, uses


@dataclass(frozen=True)
class Tried:
    """One motion on all robots."""

    motion: str
    sha256: str
    """Share of the clip's frames."""
    seconds: float
    robots: int
    fell: int
    damped: int
    """Robots that did not fall, and that a rule would have damped."""
    share: float
    """Share of the robots on which the motion did not reach its end."""
    ci95: tuple[float, float]
    """Wilson's interval of that share."""
    tilt_deg: float
    """Largest angle between the pelvis and its reference on the robots that did not fall, or on all where all did."""
    room_rad: float
    """Smallest distance to an end of a joint's range."""
    room_joint: str
    uses: dict[str, tuple[float, str, float]]
    """Rule -> largest share of its limit, joint, time in the clip [s]."""
    watch: tuple[str, ...]
    """The two rules that come nearest to damping, nearest first."""


@dataclass(frozen=True)
class Sheet:
    """Motions that were tried, the least risky first, and those that there was no time for."""

    policy: str
    sha256: str
    robots: int
    seed: int
    randomisation: dict[str, Any]
    limits: dict[str, Any]
    tried: tuple[Tried, ...]
    untried: tuple[str, ...]


def make_sheet(
    policy: ExportedPolicy,
    clips: Sequence[Clip],
    robots: int,
    limits: Limits,
    seed: int = 0,
    seconds: float = float("inf"),
    on_motion: Callable[[str], None] = lambda said: None,
) -> Sheet:
    """Try motions one after the other.

    Args:
        policy: what follows them.
        clips: the motions, 50 Hz.
        robots: number of robots drawn from the paper's randomisation, the same for all motions.
        limits: of the guard.
        seed: of the robots, of start and sensor noise.
        seconds: no motion begins after so long; the first is always tried.
        on_motion: told after each motion what came.
    """
    drawn, drives, end = DrawnRobots(robots, PAPER_RANDOMISATION, seed), drives_of(policy.contract), time.monotonic()
    tried: list[Tried] = []
    end += seconds
    for clip in clips:
        if tried and time.monotonic() > end:
            break
        tried.append(_try(policy, clip, drawn, robots, drives, limits, seed))
        on_motion(f"{clip.name}: {outcome(tried[-1])}")
    order = sorted(tried, key=lambda one: (one.share, one.tilt_deg))
    left = tuple(clip.name for clip in clips[len(tried) :])
    known = (asdict(PAPER_RANDOMISATION), asdict(limits))
    return Sheet(policy.folder.name, policy.sha256, robots, seed, *known, tuple(order), left)


def outcome(tried: Tried) -> str:
    """One motion's result in a few words."""
    low, high = tried.ci95
    lost = f"fell on {tried.fell}, damped on {tried.damped} of {tried.robots} robots"
    return f"{lost}: not to the end on {100 * tried.share:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"


def _try(
    policy: ExportedPolicy, clip: Clip, drawn: DrawnRobots, robots: int, drives: Drives, limits: Limits, seed: int
) -> Tried:
    episodes = [Episode(f"{clip.name}-{k}", "policy", clip.name, seed + k) for k in range(robots)]
    stop, noise = Stop(limits.tilt_deg, limits.drop_m), SensorNoise(base="odometry")
    rollouts = run_episodes(
        lambda count: drawn, episodes, {"policy": policy}, {clip.name: clip}, noise, stop=stop, judged=True
    )
    each = [(rollout, _uses(rollout, clip, drives, limits)) for rollout in rollouts]
    stood = [(rollout, found) for rollout, found in each if rollout.frames == clip.frames]
    damped = sum(any(found[rule].share > 1 for rule in DAMPING) for _, found in stood)
    lost, worst = robots - len(stood) + damped, dict[str, Use]()
    for _, found in stood or each:
        for rule, use in found.items():
            worst[rule] = max(worst.get(rule, use), use, key=lambda one: one.share)
    nearest = sorted(DAMPING, key=lambda rule: -worst[rule].share)[:2]
    rooms = [room(rollout.joint_pos, drives) for rollout, _ in stood or each]
    shares = {rule: (round(use.share, 4), use.joint, use.row / clip.fps) for rule, use in worst.items()}
    return Tried(
        clip.name, clip_digest(clip), clip.frames / clip.fps, robots, robots - len(stood), damped, lost / robots,
        wilson(lost, robots), worst["tilt"].share * limits.tilt_deg, *min(rooms), shares, tuple(nearest),
    )  # fmt: skip


def _uses(rollout: Rollout, clip: Clip, drives: Drives, limits: Limits) -> dict[str, Use]:
    quat, pos, torque, action = rollout.base_quat, rollout.base_pos, rollout.joint_torque, rollout.action
    assert quat is not None and pos is not None and torque is not None and action is not None  # the simulation's
    measured = Measured(rollout.joint_pos, rollout.joint_vel, torque, action, quat, pos[:, 2])
    turned, height = (part[: rollout.frames].astype(float) for part in (clip.root_quat, clip.root_pos[:, 2]))
    return uses(measured, turned, height, drives, limits)
