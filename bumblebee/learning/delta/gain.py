"""Does a delta action beat no delta? Replayed on rollouts that took no part in its training, and tested by motion.

Rollouts of one motion are the same policy going the same way again: they err alike, and count as one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from scipy import stats
from torch import Tensor

from bumblebee.learning.delta.env import restart
from bumblebee.learning.delta.recordings import Recordings
from bumblebee.sim.engine import Engine, RobotState
from bumblebee.sim.rotations import angle_between

HORIZONS = (0.2, 1.0)
Adapter = Callable[[RobotState, Tensor], Tensor]


@dataclass(frozen=True)
class Gain:
    """Relative change of the error that the delta brings, by horizon: below 0 is better; paired by motion."""

    rollouts: int
    motions: int
    change: dict[str, dict[str, float]]
    """Horizon [s] -> {"without", "with" (errors), "relative", "low", "high" (95 %, t over motions)}."""
    promoted: bool
    """Whether the interval at the longest horizon lies below zero and no shorter one above."""
    reason: str
    """Why it was promoted or not, for a person."""


def replay_error(
    engine: Engine, recordings: Recordings, encoder_offset: Tensor, adapter: Adapter | None, stride: int = 25
) -> dict[str, np.ndarray]:
    """State error of each rollout after each of `HORIZONS` seconds, (R,) [rad].

    Windows start every `stride` rows from the recorded state. The error is the root mean square over joints of the
    joint angles' error, plus the angle of the base's rotation error; windows that end early count no horizon beyond.
    """
    frames = [round(h / engine.control_dt) for h in HORIZONS]
    rows_all = recordings.windows(frames[0], stride)
    errors = {h: torch.full((len(rows_all),), float("nan")) for h in HORIZONS}
    last_row = recordings.start + recordings.length - 1
    for begin in range(0, len(rows_all), engine.num_worlds):
        rows = rows_all[begin : begin + engine.num_worlds]
        count = len(rows)
        filled = torch.cat([rows, rows[-1:].expand(engine.num_worlds - count)])
        end = last_row[recordings.owner(filled)]
        restart(engine, recordings, torch.arange(engine.num_worlds), filled, encoder_offset)
        for k in range(max(frames)):
            now = torch.minimum(filled + k, end)
            targets = recordings.targets[now]
            engine.step(targets if adapter is None else adapter(engine.state(), targets))
            for horizon, at in zip(HORIZONS, frames, strict=True):
                if k + 1 == at:
                    reached = (filled + at <= end)[:count]
                    state, wanted = engine.state(), recordings.qpos[torch.minimum(filled + at, end)]
                    error = state_error(state.root_quat_w, state.joint_pos, wanted)[:count]
                    errors[horizon][begin : begin + count] = torch.where(reached, error, torch.nan)
    owner = recordings.owner(rows_all).numpy()
    return {str(h): by_rollout(errors[h].numpy(), owner, len(recordings.ids)) for h in HORIZONS}


def compare(without: dict[str, np.ndarray], with_delta: dict[str, np.ndarray], motions: Sequence[str]) -> Gain:
    """Paired comparison of two sets of `replay_error`; rollouts of one motion alone promote nothing.

    Args:
        without: horizon -> error of each rollout (R,) without the delta.
        with_delta: the same with it.
        motions: (R) the motion of each rollout.
    """
    change, count, names = {}, 0, np.array(motions)
    told: set[str] = set()
    for horizon, before in without.items():
        after = with_delta[horizon]
        both = np.isfinite(before) & np.isfinite(after) & (before > 0)
        relative = after[both] / before[both] - 1.0
        count = max(count, len(relative))
        told |= set(names[both])
        by_motion = np.array([relative[names[both] == name].mean() for name in sorted(set(names[both]))])
        low, high = _t_interval(by_motion)
        mean = float(by_motion.mean()) if len(by_motion) else float("nan")
        values = (float(before[both].mean()), float(after[both].mean())) if both.any() else (float("nan"),) * 2
        change[horizon] = {"without": values[0], "with": values[1], "relative": mean, "low": low, "high": high}
    longest = change[max(change, key=float)]
    worse = any(c["low"] > 0 for c in change.values())
    if change and all(c["with"] == c["without"] for c in change.values()):
        reason = "nothing was found that it should correct"
    elif len(told) < 2:
        reason = "the held-out rollouts are of one motion, or their metadata name no `motion`: there is no interval"
    elif worse:
        reason = "it makes the error worse at some horizon"
    elif not longest["high"] < 0:
        reason = "it does not beat no delta beyond its interval"
    else:
        return Gain(count, len(told), change, True, "its error is lower beyond the interval")
    return Gain(count, len(told), change, False, reason)


def state_error(root_quat: Tensor, joint_pos: Tensor, qpos: Tensor) -> Tensor:
    """Root mean square over joints (B, J) of their error, plus the angle of the base's rotation error, (B,) [rad].

    Args:
        root_quat: (B, 4) wxyz.
        joint_pos: (B, J) [rad].
        qpos: (B, 7 + J) recorded.
    """
    joints = (joint_pos - qpos[:, 7:]).square().mean(-1).sqrt()
    return joints + angle_between(qpos[:, 3:7], root_quat)


def by_rollout(errors: np.ndarray, owner: np.ndarray, count: int) -> np.ndarray:
    """Root mean square (count,) of each rollout's finite errors (W,), NaN without any; `owner` (W,) says whose."""
    means = np.full(count, np.nan)
    for r in range(count):
        own = errors[(owner == r) & np.isfinite(errors)]
        if len(own):
            means[r] = np.sqrt(np.mean(own**2))
    return means


def _t_interval(values: np.ndarray) -> tuple[float, float]:
    if len(values) < 2:
        return float("nan"), float("nan")
    half = float(stats.t.ppf(0.975, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values)))
    return float(values.mean() - half), float(values.mean() + half)
