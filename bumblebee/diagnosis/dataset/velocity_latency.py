"""Velocities that a log has older than its positions: how much, joint by joint, and the log with them in step.

A drive filters its velocity or reads it a cycle before the position. A window that starts from such a reading starts
too slow where the joint speeds up, and what that does grows with the horizon: 4 ms of age are 10 mrad after 0.2 s where
a joint accelerates by 12 rad/s^2. Over a span the integral of velocities of age e is less than the way made by e times
the change of velocity; the change that the positions show is the instrument, so that noise of the velocities makes the
age no smaller. A simulation that moves its positions by the new velocities has them half a step apart: that much, at
steps of a millisecond, is no age. In logs of position targets a servo answers a new target within the
period, and a joint that speeds up at its beginning goes further than the velocities at the ticks say, which passes for
an age of up to half a period: there only ages of more than a period count.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.thresholds.dataset import VelocityLatency
from bumblebee.measured.rollout import Rollout


def velocity_ages(rollouts: Sequence[Rollout], rule: VelocityLatency) -> np.ndarray:
    """Ages (J,) [s] of the logged joint velocities against the positions; 0 where none is beyond doubt."""
    joints = len(rollouts[0].joints)
    ages, sure = np.zeros(joints), np.zeros(joints, dtype=bool)
    aimed = any(rollout.joint_target is not None for rollout in rollouts)
    period = max(float(np.median(np.diff(rollout.time))) for rollout in rollouts)
    least = rule.least + (rule.periods * period if aimed else 0.0)
    for _ in range(rule.rounds):
        found, error = _ages([in_step(r, ages) for r in rollouts], rule)
        ages = ages + found
        sure = np.abs(ages) - least > rule.doubt * error
        ages = np.where(np.abs(ages) <= rule.most, ages, 0.0)
    return np.where(sure, ages, 0.0)


def in_step(rollout: Rollout, ages: np.ndarray) -> Rollout:
    """The rollout with each joint's velocities as logged `ages` (J,) [s] later, less the ticks that lack one."""
    if not ages.any():
        return rollout
    time, speed = rollout.time, rollout.joint_vel
    moved = np.stack([np.interp(time + age, time, v) for age, v in zip(ages, speed.T, strict=True)], axis=1)
    keep = (time + ages.max() <= time[-1]) & (time + ages.min() >= time[0])
    rest = {name: getattr(rollout, name)[keep] for name in rollout.columns}
    return replace(rollout, **(rest | {"time": time[keep], "joint_vel": moved[keep]}))


def age_note(joints: Sequence[str], ages: np.ndarray) -> str:
    """Note for a person on ages (J,) that were found; empty where there are none."""
    late = [f"{name} {1e3 * age:.1f} ms" for name, age in zip(joints, ages, strict=True) if age]
    return f"logged velocities lag the positions; their timestamps were aligned: {', '.join(late)}" if late else ""


def _ages(rollouts: Sequence[Rollout], rule: VelocityLatency) -> tuple[np.ndarray, np.ndarray]:
    """Ages (J,) [s] by two-stage least squares over all rollouts, and standard errors (J,) by a jackknife of parts."""
    parts = [part for r in rollouts for part in _products(r, rule)]
    if len(parts) < rule.enough:
        return np.zeros(len(rollouts[0].joints)), np.full(len(rollouts[0].joints), np.inf)
    normal, right = (np.array(x) for x in zip(*parts, strict=True))  # (P, J, 2, 2), (P, J, 2)
    whole = _solved(normal.sum(axis=0), right.sum(axis=0))
    without = _solved(normal.sum(axis=0) - normal, right.sum(axis=0) - right)
    count = len(parts)
    return whole, np.sqrt((count - 1) / count * ((without - without.mean(axis=0)) ** 2).sum(axis=0))


def _solved(normal: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The first coefficient of each 2 x 2 system (..., 2, 2), (..., 2); 0 where there is no motion to tell it."""
    det = normal[..., 0, 0] * normal[..., 1, 1] - normal[..., 0, 1] * normal[..., 1, 0]
    top = right[..., 0] * normal[..., 1, 1] - normal[..., 0, 1] * right[..., 1]
    return np.where(np.abs(det) > 1e-30, top / np.where(det == 0, 1.0, det), 0.0)


def _products(rollout: Rollout, rule: VelocityLatency) -> list[tuple[np.ndarray, np.ndarray]]:
    """Products of the instruments with regressors (J, 2, 2) and with what lacks (J, 2), for each part of a rollout."""
    time, place, speed = rollout.time, rollout.joint_pos, rollout.joint_vel
    period = float(np.median(np.diff(time)))
    near, span = max(1, round(rule.near / period)), max(2, round(rule.span / period))
    first = np.arange(near, len(time) - span - near)
    if len(first) < rule.parts * span:
        return []
    last = first + span
    even = time[last + near] - time[first - near] < rule.gap * (span + 2 * near) * period  # no gap in between
    first, last = first[even], last[even]
    way = np.concatenate((np.zeros((1, speed.shape[1])), np.cumsum(_trapezes(time, speed), axis=0)))
    made = place[last] - place[first]
    lacks = made - (way[last] - way[first])
    around = lambda at: (place[at + near] - place[at - near]) / (time[at + near] - time[at - near])[:, None]  # noqa: E731
    regressors = np.stack((speed[last] - speed[first], made), axis=-1)
    instruments = np.stack((around(last) - around(first), made), axis=-1)
    normal = np.einsum("nji,njk->njik", instruments, regressors)
    right = instruments * lacks[..., None]
    return [(normal[k].sum(axis=0), right[k].sum(axis=0)) for k in np.array_split(np.arange(len(first)), rule.parts)]


def _trapezes(time: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Ways (T - 1, J) between ticks."""
    return 0.5 * (speed[1:] + speed[:-1]) * np.diff(time)[:, None]
