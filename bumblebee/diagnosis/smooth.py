"""Fast logs, smoothed: positions and velocities of a joint as one motion, fitted over some milliseconds.

A window starts from a reading, and a velocity read with 0.07 rad/s of noise is 14 mrad off after 0.2 s: enough to hide
friction. At a few hundred hertz the positions around a tick say the velocity far better than its own reading does.
Each joint is fitted at each tick by a cubic in time over +-10 ms, positions and velocities weighted by their noise; the
fit's own covariance is the noise that is left. Slow logs stay as read, and floating bases, whose impacts are shorter.

Drives often difference their positions, and report a velocity that is as old as half the difference is long. How old it
is follows from velocities and positions alone: what a velocity reading lacks of the positions' own goes with the
acceleration. The fit takes each velocity for that of its own time.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.signals import Layout
from bumblebee.measured.rollout import Rollout

HALF_SPAN = 0.01  # [s]
_TERMS = 4  # of the polynomial
_LEAST = 2  # neighbours on either side from which on there is something to gain
_SURE = 4.0  # standard errors that an age of velocities must have
_OLDEST = 0.5 * HALF_SPAN  # [s]


def smooth_rollouts(
    rollouts: Sequence[Rollout], layout: Layout, sigma: np.ndarray
) -> tuple[list[Rollout], np.ndarray, int, np.ndarray]:
    """Smoothed rollouts, the noise (D,) left in them, how many were fast enough, the ages (J,) of velocities [s]."""
    out, left, count = [], [], 0
    parts = layout.slices["joint_pos"], layout.slices["joint_vel"]
    near_of = [_neighbours(rollout) for rollout in rollouts]
    age = velocity_age([r for r, near in zip(rollouts, near_of, strict=True) if near])
    for rollout, near in zip(rollouts, near_of, strict=True):
        if not near:
            out.append(rollout)
            left.append(sigma**2)
            continue
        place, speed, variance = _smooth(rollout, near, sigma[parts[0]], sigma[parts[1]], age)
        out.append(replace(rollout, joint_pos=place, joint_vel=speed))
        mine = sigma**2
        mine[parts[0]], mine[parts[1]] = variance
        left.append(mine)
        count += 1
    return out, np.sqrt(np.mean(left, axis=0)), count, age


def velocity_age(rollouts: Sequence[Rollout]) -> np.ndarray:
    """How much older than the positions each joint's velocities are (J,) [s]; 0 where the fast `rollouts` do not say.

    A regression of what the velocities lack of those that the positions have, on the acceleration; its error by rollout
    where there are several.
    """
    if not rollouts:
        return np.zeros(0)
    joints = rollouts[0].joint_pos.shape[1]
    sums = np.zeros((len(rollouts), 2, joints))
    for k, rollout in enumerate(rollouts):
        near = _neighbours(rollout)
        inner = slice(2 * near, -2 * near)
        fitted = _fitted(rollout, near, np.ones(joints), np.full(joints, np.inf), np.zeros(joints))[0]
        turn = 2.0 * fitted[inner, :, 2] / HALF_SPAN**2
        lacks = fitted[inner, :, 1] / HALF_SPAN - rollout.joint_vel[inner]
        sums[k] = (turn * lacks).sum(axis=0), (turn**2).sum(axis=0)
    whole = np.maximum(sums[:, 1].sum(axis=0), 1e-300)
    age = sums[:, 0].sum(axis=0) / whole
    if len(rollouts) < 2:
        return np.zeros(joints)
    scores = sums[:, 0] - age * sums[:, 1]
    error = np.sqrt((scores**2).sum(axis=0) * len(rollouts) / (len(rollouts) - 1)) / whole
    return np.where((np.abs(age) > _SURE * error) & (np.abs(age) < _OLDEST), age, 0.0)


def _neighbours(rollout: Rollout) -> int:
    """Rows on either side that are fitted; 0 for a log that is too slow or too short."""
    near = round(HALF_SPAN / float(np.median(np.diff(rollout.time))))
    return 0 if near < _LEAST or rollout.frames < 4 * near else near


def _smooth(
    rollout: Rollout, near: int, sigma_pos: np.ndarray, sigma_vel: np.ndarray, age: np.ndarray
) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Positions and velocities (T, J) of the local fits, and the median variances (J,) of both."""
    fitted, inverse = _fitted(rollout, near, sigma_pos, sigma_vel, age)
    variance = (
        sigma_pos**2 * np.median(inverse[..., 0, 0], axis=0),
        sigma_pos**2 * np.median(inverse[..., 1, 1], axis=0) / HALF_SPAN**2,
    )
    return rollout.joint_pos + fitted[..., 0], fitted[..., 1] / HALF_SPAN, variance


def _fitted(
    rollout: Rollout, near: int, sigma_pos: np.ndarray, sigma_vel: np.ndarray, age: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (T, J, terms) over time in half spans, the reading itself taken off, and their covariances.

    Velocities are `age` (J,) [s] older than their rows. The covariances (T, J, terms, terms) are in units of
    `sigma_pos` (J,) squared; infinite `sigma_vel` (J,) leaves velocities out.
    """
    first = np.arange(rollout.frames)[:, None] + np.arange(-near, near + 1)
    rows = np.clip(first, 0, rollout.frames - 1)
    shift = rollout.time[rows] - rollout.time[:, None]
    inside = (np.abs(shift) <= 1.5 * HALF_SPAN) & (first == rows)  # a gap in the log has no neighbours beyond it
    u = shift / HALF_SPAN
    powers = np.stack([u**k for k in range(_TERMS)], axis=-1) * inside[..., None]
    found, covers = [], []
    for j, (noise, noisy) in enumerate(zip(sigma_pos, sigma_vel, strict=True)):
        back = u - age[j] / HALF_SPAN
        slopes = [np.zeros_like(u), *(k * back ** (k - 1) / HALF_SPAN for k in range(1, _TERMS))]
        slopes = np.stack(slopes, axis=-1) * inside[..., None]
        rate = max(noisy, 1e-9) / max(noise, 1e-12)  # scaled so that a position weighs 1
        normal = np.einsum("tka,tkb->tab", powers, powers) + np.einsum("tka,tkb->tab", slopes, slopes) / rate**2
        normal = normal + 1e-9 * np.eye(_TERMS)
        right = np.einsum("tka,tk->ta", powers, rollout.joint_pos[rows, j] - rollout.joint_pos[:, None, j])
        right += np.einsum("tka,tk->ta", slopes, rollout.joint_vel[rows, j]) / rate**2
        covers.append(np.linalg.inv(normal))
        found.append(np.einsum("tab,tb->ta", covers[-1], right))
    return np.stack(found, axis=1), np.stack(covers, axis=1)
