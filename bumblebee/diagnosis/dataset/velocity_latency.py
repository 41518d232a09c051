"""Velocities that a log has older than its positions: how much, joint by joint, and the log with them in step.

A drive filters its velocity or reads it a cycle before the position. A window that starts from such a reading starts
too slow where the joint speeds up, and what that does grows with the horizon: 4 ms of age are 10 mrad after 0.2 s where
a joint accelerates by 12 rad/s^2. Over a span the integral of velocities of age e is less than the way made by e times
the change of velocity; the change that the positions show is the instrument, so that noise of the velocities makes the
age no smaller. A simulation that moves its positions by the new velocities has them half a step apart: that much, at
steps of a millisecond, is no age. In logs of position targets a servo answers a new target within the
period, and a joint that speeds up at its beginning goes further than the velocities at the ticks say, which passes for
an age of up to half a period: there only ages of more than a period count.

The estimate is a linearisation about where it starts, good to half a period of the motion. So it starts at the age of a
grid at which the integrated velocities come nearest to the ways. An age beyond that of a reading is a filter's or a
second clock's; such velocities are replaced by differences of the positions, before the checks judge signs by them.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.thresholds.dataset import VelocityLatency
from bumblebee.measured.rollout import Rollout


def velocity_ages(rollouts: Sequence[Rollout], rule: VelocityLatency) -> np.ndarray:
    """Ages (J,) [s] of the logged joint velocities against the positions; 0 where none is beyond doubt."""
    ages = _starts(rollouts, rule)
    sure = np.zeros(len(ages), dtype=bool)
    aimed = any(rollout.joint_target is not None for rollout in rollouts)
    period = max(float(np.median(np.diff(rollout.time))) for rollout in rollouts)
    least = rule.least + (rule.periods * period if aimed else 0.0)
    for _ in range(rule.rounds):
        found, error = _ages([in_step(r, ages) for r in rollouts], rule)
        ages = ages + found
        sure = np.abs(ages) - least > rule.doubt * error
        ages = np.where(np.abs(ages) <= rule.sought, ages, 0.0)
    return np.where(sure, ages, 0.0)


def with_known_velocities(rollouts: Sequence[Rollout], rule: VelocityLatency) -> tuple[list[Rollout], list[str]]:
    """The rollouts with differences of the positions for velocities that are too old for a reading, and a note.

    Rollouts that the checks will refuse (other joints, no numbers, no clock) stay as they are.
    """
    able = [r.joints == rollouts[0].joints and _has_clock_and_numbers(r) for r in rollouts]
    if not any(able):
        return list(rollouts), []
    ages = velocity_ages([r for r, one in zip(rollouts, able, strict=True) if one], rule)
    late = np.abs(ages) > rule.most
    if not late.any():
        return list(rollouts), []
    made = [_from_positions(r, late) if one else r for r, one in zip(rollouts, able, strict=True)]
    note = "logged velocities are too old to be used; differences of the positions take their place"
    return made, [f"{note}: {_listed(rollouts[0].joints, np.where(late, ages, 0.0))}"]


def _has_clock_and_numbers(rollout: Rollout) -> bool:
    with np.errstate(over="ignore"):  # what no sensor reads is for the checks to refuse
        squares = np.column_stack((rollout.joint_pos, rollout.joint_vel)) ** 2
    return bool(np.isfinite(squares).all() and (np.diff(rollout.time) > 0).all() and rollout.frames > 1)


def _from_positions(rollout: Rollout, which: np.ndarray) -> Rollout:
    made = np.gradient(rollout.joint_pos, rollout.time, axis=0)
    return replace(rollout, joint_vel=np.where(which, made, rollout.joint_vel))


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
    late = _listed(joints, ages)
    return f"logged velocities lag the positions; their timestamps were aligned: {late}" if late else ""


def _listed(joints: Sequence[str], ages: np.ndarray) -> str:
    return ", ".join(f"{name} {1e3 * age:.1f} ms" for name, age in zip(joints, ages, strict=True) if age)


def _starts(rollouts: Sequence[Rollout], rule: VelocityLatency) -> np.ndarray:
    """Ages (J,) [s] of a grid that leave least of the ways; 0 where they leave no less than none, beyond doubt."""
    grid = np.arange(0.0, rule.sought + rule.near, rule.near)
    parts = [part for r in rollouts for part in _misfits(r, grid, rule)]
    if len(parts) < 2:
        return np.zeros(len(rollouts[0].joints))
    misfits = np.array(parts)  # (P, G, J)
    best = misfits.sum(axis=0).argmin(axis=0)
    least = np.take_along_axis(misfits, best[None, None], axis=1)[:, 0]
    gain = (misfits[:, 0] - least) / np.maximum(misfits[:, 0] + least, 1e-30)  # of one size, however a part moves
    sure = gain.mean(axis=0) > rule.doubt * gain.std(axis=0, ddof=1) / np.sqrt(len(parts))
    return np.where(sure, grid[best], 0.0)


def _misfits(rollout: Rollout, grid: np.ndarray, rule: VelocityLatency) -> list[np.ndarray]:
    """Squares (G, J) of the ways that velocities of each age leave, for each part of a rollout."""
    time, place = rollout.time, rollout.joint_pos
    span = max(2, round(rule.span / float(np.median(np.diff(time)))))
    first = np.arange(np.searchsorted(time, time[-1] - grid[-1]) - span)
    if len(first) < rule.parts * span:
        return []
    way = np.concatenate((np.zeros((1, place.shape[1])), np.cumsum(_trapezes(time, rollout.joint_vel), axis=0)))
    left = []
    for age in grid:
        gone = np.stack([np.interp(time + age, time, column) for column in way.T], axis=1)
        left.append((place[first + span] - place[first] - gone[first + span] + gone[first]) ** 2)
    squares = np.stack(left, axis=1)
    return [squares[k].sum(axis=0) for k in np.array_split(np.arange(len(first)), rule.parts)]


def _ages(rollouts: Sequence[Rollout], rule: VelocityLatency) -> tuple[np.ndarray, np.ndarray]:
    """Ages (J,) [s] by two-stage least squares over all rollouts, and standard errors (J,) by a jackknife of parts."""
    parts = [part for r in rollouts for part in _products(r, rule)]
    if not parts:
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
