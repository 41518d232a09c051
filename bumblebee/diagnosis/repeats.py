"""Which rollouts are repeats: the same commands again, whatever they are called.

A repeat of a fitted motion on the held-out side would be no test. Loggers name files by date, so names say little.
"""

from collections.abc import Sequence

import numpy as np

from bumblebee.measured.rollout import Rollout

_SAMPLES = 200
_SAME = 0.1  # mean difference of the commands over their mean size
_LENGTH = 0.1  # relative difference of durations


def motion_names(rollouts: Sequence[Rollout]) -> list[str]:
    """A name for each rollout's motion: its own, or that of an earlier rollout with the same commands."""
    names = [str(r.meta.get("motion")) for r in rollouts]
    paths = [_path(r) for r in rollouts]
    for i, mine in enumerate(paths):
        for k in range(i):
            if mine is not None and paths[k] is not None and _same(rollouts[i], rollouts[k], mine, paths[k]):
                names[i] = names[k]
                break
    return names


def _path(rollout: Rollout) -> np.ndarray | None:
    """Commands at equally spaced times (J, 200), about their mean; None where nothing is commanded."""
    command = rollout.joint_target if rollout.joint_target is not None else rollout.joint_torque_cmd
    if command is None or rollout.frames < 10:
        return None
    at = np.linspace(rollout.time[0], rollout.time[-1], _SAMPLES)
    path = np.stack([np.interp(at, rollout.time, column) for column in command.T])
    path -= path.mean(axis=1, keepdims=True)
    return path if np.abs(path).mean() > 1e-9 else None


def _same(a: Rollout, b: Rollout, mine: np.ndarray, other: np.ndarray | None) -> bool:
    if other is None or mine.shape != other.shape or abs(a.duration - b.duration) > _LENGTH * a.duration:
        return False
    return bool(np.abs(mine - other).mean() < _SAME * np.abs(mine).mean())
