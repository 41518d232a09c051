"""Fast logs, smoothed: positions and velocities of a joint as one motion, fitted over some milliseconds.

A window starts from a reading, and a velocity read with 0.07 rad/s of noise is 14 mrad off after 0.2 s: enough to hide
friction. At a few hundred hertz the positions around a tick say the velocity far better than its own reading does.
Each joint is fitted at each tick by a cubic in time over +-10 ms, positions and velocities weighted by their noise; the
fit's own covariance is the noise that is left. Slow logs stay as read, and floating bases, whose impacts are shorter.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.simulation import Layout
from bumblebee.diagnosis.thresholds.dataset import Smoothing
from bumblebee.measured.rollout import Rollout


def smooth_rollouts(
    rollouts: Sequence[Rollout], layout: Layout, sigma: np.ndarray, rule: Smoothing
) -> tuple[list[Rollout], np.ndarray, int]:
    """Smoothed rollouts, the noise (D,) that is left in them, and how many were fast enough to be smoothed."""
    out, left, count = [], [], 0
    parts = layout.slices["joint_pos"], layout.slices["joint_vel"]
    for rollout in rollouts:
        near = round(rule.half_span / float(np.median(np.diff(rollout.time))))
        if near < rule.neighbours or rollout.frames < rule.spans * near:
            out.append(rollout)
            left.append(sigma**2)
            continue
        place, speed, variance = _smooth(rollout, near, sigma[parts[0]], sigma[parts[1]], rule)
        out.append(replace(rollout, joint_pos=place, joint_vel=speed))
        mine = sigma**2
        mine[parts[0]], mine[parts[1]] = variance
        left.append(mine)
        count += 1
    return out, np.sqrt(np.mean(left, axis=0)), count


def _smooth(
    rollout: Rollout, near: int, sigma_pos: np.ndarray, sigma_vel: np.ndarray, rule: Smoothing
) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Positions and velocities (T, J) of the local fits, and the median variances (J,) of both."""
    span, terms = rule.half_span, rule.terms
    rows = np.clip(np.arange(rollout.frames)[:, None] + np.arange(-near, near + 1), 0, rollout.frames - 1)
    shift = rollout.time[rows] - rollout.time[:, None]
    inside = np.abs(shift) <= rule.beyond * span  # a gap in the log has no neighbours beyond it
    first = np.arange(rollout.frames)[:, None] + np.arange(-near, near + 1)
    inside &= first == rows
    u = shift / span
    powers = np.stack([u**k for k in range(terms)], axis=-1) * inside[..., None]
    slopes = np.stack([np.zeros_like(u)] + [k * u ** (k - 1) / span for k in range(1, terms)], axis=-1)
    slopes = slopes * inside[..., None]
    place, speed = np.empty_like(rollout.joint_pos), np.empty_like(rollout.joint_vel)
    variance = np.empty(place.shape[1]), np.empty(place.shape[1])
    for j in range(place.shape[1]):
        rate = max(sigma_vel[j], 1e-9) / max(sigma_pos[j], 1e-12)  # scaled so that a position weighs 1
        normal = np.einsum("tka,tkb->tab", powers, powers) + np.einsum("tka,tkb->tab", slopes, slopes) / rate**2
        normal = normal + 1e-9 * np.eye(terms)
        right = np.einsum("tka,tk->ta", powers, rollout.joint_pos[rows, j] - rollout.joint_pos[:, None, j])
        right += np.einsum("tka,tk->ta", slopes, rollout.joint_vel[rows, j]) / rate**2
        inverse = np.linalg.inv(normal)
        fitted = np.einsum("tab,tb->ta", inverse, right)
        place[:, j] = rollout.joint_pos[:, j] + fitted[:, 0]
        speed[:, j] = fitted[:, 1] / span
        variance[0][j] = sigma_pos[j] ** 2 * np.median(inverse[:, 0, 0])
        variance[1][j] = sigma_pos[j] ** 2 * np.median(inverse[:, 1, 1]) / span**2
    return place, speed, variance
