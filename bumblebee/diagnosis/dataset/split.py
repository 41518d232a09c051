"""Which rollouts are repeats: the same commands again, whatever they are called.

A repeat of a fitted motion on the held-out side would be no test. Loggers name files by date, so names say little.
"""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.thresholds.dataset import Split
from bumblebee.measured.rollout import Rollout

_COMMANDED = 1e-9
"""Mean size of the commands [their unit] above which something is commanded at all."""


def motion_names(rollouts: Sequence[Rollout], rule: Split) -> list[str]:
    """A name for each rollout's motion: its own, or that of an earlier rollout with the same commands."""
    names = [str(r.meta.get("motion")) for r in rollouts]
    paths = [_path(r, rule) for r in rollouts]
    for i, mine in enumerate(paths):
        for k in range(i):
            if mine is not None and paths[k] is not None and _same(rollouts[i], rollouts[k], mine, paths[k], rule):
                names[i] = names[k]
                break
    return names


def _path(rollout: Rollout, rule: Split) -> np.ndarray | None:
    """Commands at equally spaced times (J, samples), about their mean; None where nothing is commanded."""
    command = rollout.joint_target if rollout.joint_target is not None else rollout.joint_torque_cmd
    if command is None or rollout.frames < rule.rows:
        return None
    at = np.linspace(rollout.time[0], rollout.time[-1], rule.samples)
    path = np.stack([np.interp(at, rollout.time, column) for column in command.T])
    path -= path.mean(axis=1, keepdims=True)
    return path if np.abs(path).mean() > _COMMANDED else None


def _same(a: Rollout, b: Rollout, mine: np.ndarray, other: np.ndarray | None, rule: Split) -> bool:
    if other is None or mine.shape != other.shape or abs(a.duration - b.duration) > rule.length * a.duration:
        return False
    return bool(np.abs(mine - other).mean() < rule.same * np.abs(mine).mean())


def accepting(rollouts: Sequence[Rollout], train: Sequence[int], holdout: Sequence[int], rule: Split) -> list[int]:
    """Rollouts to decide on: where there are enough to fit every fourth (by motion), else those that are held out."""
    if len(train) < rule.enough:
        return list(holdout)
    _, some = split([rollouts[i] for i in train], rule)
    return [train[k] for k in some]


def accepting_across(motions: Sequence[str], conditions: Sequence[object], rule: Split) -> list[int]:
    """Rollouts to decide on where the same motions were recorded under several conditions: every fourth pair of both.

    The pairs are taken from as many motions and conditions as they go, so that what is decided by is neither one
    motion's nor one condition's, and every motion and condition stays in the fit as far as it can. Of a
    single motion every fourth rollout is taken.
    """
    if len(set(motions)) == 1:
        motions = [f"{i:06d}" for i in range(len(motions))]
    groups: dict[tuple[str, str], list[int]] = {}
    for i, key in enumerate(zip(motions, map(str, conditions), strict=True)):
        groups.setdefault(key, []).append(i)
    left = sorted(groups)
    if len(left) < 2:
        return []
    count = -(-len(left) // min(rule.every, len(left)))
    usual = np.unique(np.linspace(min(rule.every, len(left)) - 1, len(left) - 1, count).round().astype(int))
    taken: list[tuple[str, str]] = []
    for place in usual:
        used = [sum(key[part] == other[part] for other in taken for part in (0, 1)) for key in left]
        order = [(n, abs(k - place)) for k, n in enumerate(used)]
        order = [(len(left), 0) if key in taken else one for key, one in zip(left, order, strict=True)]
        taken.append(left[order.index(min(order))])
    return sorted(i for key in taken for i in groups[key])


def split(rollouts: Sequence[Rollout], rule: Split) -> tuple[list[int], list[int]]:
    """Indices to fit and to hold out: of each cluster's motions every fourth, with all their repeats.

    A repeat of a fitted motion would be no test: the same policy goes the same way again. Where a cluster, or a dataset
    that names no motions, has one motion only, every fourth of its rollouts is held out (the second of two).
    """
    clusters: dict[str, dict[str, list[int]]] = {}
    names = motion_names(rollouts, rule)
    for i in sorted(range(len(rollouts)), key=lambda i: rollouts[i].rollout_id):
        meta = rollouts[i].meta
        motions = clusters.setdefault(str(meta.get("cluster")), {})
        motions.setdefault(names[i], []).append(i)
    holdout: list[int] = []
    for _, motions in sorted(clusters.items()):
        groups = [group for _, group in sorted(motions.items())]
        if len(groups) == 1:
            groups = [[i] for i in groups[0]]
        every = min(rule.every, len(groups))
        if len(groups) > 1:
            # Rounded up: 6 motions hold out 2, so that a delta action, too, has something to be judged by.
            count = -(-len(groups) // every)
            picked = np.unique(np.linspace(every - 1, len(groups) - 1, count).round().astype(int))
            holdout += [i for k in picked for i in groups[k]]
    if len(holdout) == len(rollouts):
        holdout = holdout[:1]
    return [i for i in range(len(rollouts)) if i not in holdout], sorted(holdout)
