"""Kinematic rules that a motion must satisfy to be worth learning (paper, section 4.1; limits as in ProtoMotions).

Each rule is a function from a clip to its worst frame; a motion that exceeds the rule's limit is dropped, and the
drop is written down with the value, the frame and a sentence.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np
import pandas as pd

from bumblebee.motion.clip import Clip
from bumblebee.motion.kinematics import lowest_heights
from bumblebee.ranges import Range, Ranged
from bumblebee.robot.facts import KEY_BODIES, joint_names, joints

DROP_COLUMNS = ("motion", "rule", "value", "limit", "unit", "frame", "time", "explanation")


Limit = Annotated[float, Range(least=0, most=1e6)]
Speed = Annotated[float, Range(above=0, most=1e6)]


@dataclass(frozen=True)
class FilterConfig(Ranged):
    """Limits of the kinematic rules; a motion beyond one of them is dropped."""

    penetration: Limit = 0.05
    """How deep the robot's lowest point may lie under the floor [m]."""
    floating: Limit = 0.10
    """How high above the floor the robot's lowest point may stay throughout [m]."""
    airborne_height: Limit = 0.20
    """A frame whose lowest point is higher than this counts as airborne [m]."""
    airborne_seconds: Limit = 1.0
    """How long the robot may be airborne without a break [s]."""
    joint_excess: Limit = 0.05
    """How far a joint may go beyond its limit [rad]."""
    body_speed: Speed = 15.0
    """How fast a keypoint may move [m/s]."""
    joint_speed: Speed = 40.0
    """How fast a joint may turn [rad/s]; the G1's motors reach 20 to 37."""
    root_speed: Speed = 5.0
    """How fast the pelvis may move from one frame to the next [m/s]; beyond it the motion jumps."""


@dataclass(frozen=True)
class Worst:
    """A rule's finding: the worst value, its limit and unit, the frame, and a sentence for people."""

    value: float
    limit: float
    unit: str
    frame: int
    explanation: str


def floor_penetration(clip: Clip, config: FilterConfig) -> Worst:
    """Depth of the robot's lowest point under the floor."""
    heights = _heights(clip)
    body = min(heights, key=lambda name: heights[name].min())
    frame = int(np.argmin(heights[body]))
    depth = max(0.0, -float(heights[body][frame]))
    return Worst(depth, config.penetration, "m", frame, f"{body} lies {depth:.3f} m under the floor")


def floating(clip: Clip, config: FilterConfig) -> Worst:
    """The smallest distance from the floor in the whole motion: one that never comes down is wrong in height."""
    low = np.min(list(_heights(clip).values()), axis=0)
    frame = int(np.argmin(low))
    height = max(0.0, float(low[frame]))
    return Worst(height, config.floating, "m", frame, f"never nearer to the floor than {height:.3f} m")


def airborne(clip: Clip, config: FilterConfig) -> Worst:
    """The longest time without any contact possible."""
    high = np.min(list(_heights(clip).values()), axis=0) > config.airborne_height
    start, length = _longest_run(high)
    seconds = length / clip.fps
    said = f"{seconds:.2f} s more than {config.airborne_height} m above the floor"
    return Worst(seconds, config.airborne_seconds, "s", start, said)


def joint_limits(clip: Clip, config: FilterConfig) -> Worst:
    """The farthest that a joint goes beyond its range."""
    ranges = np.array([joint.range for joint in joints()])
    excess = np.maximum(ranges[:, 0] - clip.joint_pos, clip.joint_pos - ranges[:, 1])
    frame, joint = _argmax(excess)
    value, name = max(0.0, float(excess[frame, joint])), joint_names()[joint]
    said = f"{name} at {clip.joint_pos[frame, joint]:.3f} rad, range {ranges[joint, 0]:.3f} to {ranges[joint, 1]:.3f}"
    return Worst(value, config.joint_excess, "rad", frame, said)


def body_speed(clip: Clip, config: FilterConfig) -> Worst:
    """The fastest keypoint."""
    speed = np.linalg.norm(_steps(clip.key_pos, clip.fps), axis=-1)
    frame, body = _argmax(speed)
    value = float(speed[frame, body])
    return Worst(value, config.body_speed, "m/s", frame, f"{KEY_BODIES[body]} moves at {value:.1f} m/s")


def joint_speed(clip: Clip, config: FilterConfig) -> Worst:
    """The fastest joint."""
    speed = np.abs(_steps(clip.joint_pos, clip.fps))
    frame, joint = _argmax(speed)
    value = float(speed[frame, joint])
    return Worst(value, config.joint_speed, "rad/s", frame, f"{joint_names()[joint]} turns at {value:.1f} rad/s")


def root_jump(clip: Clip, config: FilterConfig) -> Worst:
    """The largest step of the pelvis between frames."""
    speed = np.linalg.norm(_steps(clip.root_pos, clip.fps), axis=-1)
    frame = int(np.argmax(speed))
    value = float(speed[frame])
    said = f"the pelvis moves {value / clip.fps:.3f} m in one frame, {value:.1f} m/s"
    return Worst(value, config.root_speed, "m/s", frame, said)


RULES: tuple[Callable[[Clip, FilterConfig], Worst], ...] = (
    floor_penetration,
    floating,
    airborne,
    joint_limits,
    body_speed,
    joint_speed,
    root_jump,
)


def violations(clip: Clip, config: FilterConfig | None = None) -> list[dict[str, object]]:
    """The rules that a clip breaks, as rows of `DROP_COLUMNS`."""
    rows = []
    for rule in RULES:
        worst = rule(clip, config or FilterConfig())
        if worst.value > worst.limit:
            time = worst.frame / clip.fps
            said = f"{worst.explanation} (frame {worst.frame}, {time:.2f} s); the limit is {worst.limit:g} {worst.unit}"
            facts = (round(worst.value, 4), worst.limit, worst.unit, worst.frame, round(time, 3), said)
            rows.append(dict(zip(DROP_COLUMNS, (clip.name, rule.__name__, *facts), strict=True)))
    return rows


def filter_clips(clips: Iterable[Clip], config: FilterConfig | None = None) -> tuple[list[Clip], pd.DataFrame]:
    """The clips that break no rule, and a table of what the others break, a row for each rule broken."""
    kept, drops = [], []
    for clip in clips:
        broken = violations(clip, config)
        drops += broken
        if not broken:
            kept.append(clip)
    return kept, pd.DataFrame(drops, columns=list(DROP_COLUMNS))


@lru_cache(maxsize=1)
def _heights(clip: Clip) -> dict[str, np.ndarray]:
    """Height of each body's lowest point, (T,) [m]; three rules ask for it in turn."""
    return lowest_heights(clip.root_pos, clip.root_quat, clip.joint_pos)


def _steps(values: np.ndarray, fps: float) -> np.ndarray:
    """Change from each frame to the next, per second, (T - 1, ...); zero for a single frame."""
    if len(values) < 2:
        return np.zeros_like(values, dtype=np.float64)
    return np.diff(values.astype(np.float64), axis=0) * fps


def _argmax(values: np.ndarray) -> tuple[int, int]:
    frame, column = np.unravel_index(int(np.argmax(values)), values.shape)
    return int(frame), int(column)


def _longest_run(flags: np.ndarray) -> tuple[int, int]:
    """Start and length of the longest run of True; (0, 0) if there is none."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    starts, ends = edges[::2], edges[1::2]
    if not len(starts):
        return 0, 0
    best = int(np.argmax(ends - starts))
    return int(starts[best]), int(ends[best] - starts[best])
