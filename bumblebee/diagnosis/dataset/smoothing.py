"""Fast logs, smoothed: positions and velocities of a joint as one motion, fitted over some milliseconds.

A window starts from a reading, and a velocity read with 0.07 rad/s of noise is 14 mrad off after 0.2 s: enough to hide
friction. At a few hundred hertz the positions around a tick say the velocity far better than its own reading does.
Each joint is fitted at each tick by a cubic in time over +-10 ms, positions and velocities weighted by their noise; the
fit's own covariance is the noise that is left. Slow logs stay as read, and floating bases, whose impacts are shorter.

Where a motion is no cubic within the span, as that of a stiff servo at a step of its command, a fit would be far off
the readings, which stay as they are.

Readings that agree better than their noise allows have the same error, as those within one step of an encoder do: a
mean of them is no better than one.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bumblebee.diagnosis.simulation import Layout
from bumblebee.diagnosis.thresholds.dataset import Smoothing
from bumblebee.measured.rollout import Rollout

_NEIGHBOURS = 2
"""Neighbours on either side from which on there is something to gain."""


@dataclass(frozen=True, eq=False)
class _Smoothed:
    """A rollout by its local fits; T ticks, J joints."""

    place: np.ndarray
    """(T, J)."""
    speed: np.ndarray
    """(T, J)."""
    variance: tuple[np.ndarray, np.ndarray]
    """(J,) that is left of positions and of velocities."""


def smooth_rollouts(
    rollouts: Sequence[Rollout], layout: Layout, sigma: np.ndarray, rule: Smoothing
) -> tuple[list[Rollout], np.ndarray, int]:
    """Smoothed rollouts, the noise (D,) that is left in them, and how many were fast enough to be smoothed."""
    out, left, count = [], [], 0
    parts = layout.slices["joint_pos"], layout.slices["joint_vel"]
    for rollout in rollouts:
        near = round(rule.half_span / float(np.median(np.diff(rollout.time))))
        if near < _NEIGHBOURS or rollout.frames < rule.spans * near:
            out.append(rollout)
            left.append(sigma**2)
            continue
        found = _smooth(rollout, near, sigma[parts[0]], sigma[parts[1]], rule)
        out.append(replace(rollout, joint_pos=found.place, joint_vel=found.speed))
        mine = sigma**2
        mine[parts[0]], mine[parts[1]] = found.variance
        left.append(mine)
        count += 1
    return out, np.sqrt(np.mean(left, axis=0)), count


def _smooth(rollout: Rollout, near: int, sigma_pos: np.ndarray, sigma_vel: np.ndarray, rule: Smoothing) -> _Smoothed:
    """The local fits over `near` ticks to either side."""
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
        noise = max(sigma_pos[j], 1e-12), max(sigma_vel[j], 1e-9)
        read = rollout.joint_pos[rows, j] - rollout.joint_pos[:, None, j], rollout.joint_vel[rows, j]
        fits = [_Signal(basis, x * inside, s) for basis, x, s in zip((powers, slopes), read, noise, strict=True)]
        inverse = np.linalg.inv(sum(fit.normal for fit in fits) + 1e-9 / noise[0] ** 2 * np.eye(terms))
        fitted = np.einsum("tab,tb->ta", inverse, sum(fit.right for fit in fits))
        missed = sum(fit.missed(fitted) for fit in fits)
        smooth = missed <= rule.bent * max(float(np.median(missed)), 2 * shift.shape[1] - terms)
        place[:, j] = rollout.joint_pos[:, j] + np.where(smooth, fitted[:, 0], 0.0)
        speed[:, j] = np.where(smooth, fitted[:, 1] / span, rollout.joint_vel[:, j])
        whole, middle = inside.all(axis=1), len(inside) // 2
        typical = np.median(inverse, axis=0)
        for k, (fit, unit) in enumerate(zip(fits, (1.0, 1.0 / span), strict=True)):
            left = typical[k, k] * unit**2
            apart = fit.missed(fitted)[whole].mean() / fit.free(typical, middle) if whole.any() else 1.0
            variance[k][j] = left if apart > rule.white else max(left, (1.0 - apart) * noise[k] ** 2)
    return _Smoothed(place, speed, variance)


@dataclass(frozen=True, eq=False)
class _Signal:
    """Readings of one kind around each of T ticks, K of them, and the B functions that fit them."""

    basis: np.ndarray
    """(T, K, B); 0 for what is no neighbour."""
    read: np.ndarray
    """(T, K); likewise."""
    sigma: float
    """Noise of a reading."""

    @property
    def normal(self) -> np.ndarray:
        """(T, B, B)."""
        return np.einsum("tka,tkb->tab", self.basis, self.basis) / self.sigma**2

    @property
    def right(self) -> np.ndarray:
        """(T, B)."""
        return np.einsum("tka,tk->ta", self.basis, self.read) / self.sigma**2

    def missed(self, fitted: np.ndarray) -> np.ndarray:
        """Chi-square (T,) of the readings about a fit (T, B)."""
        return ((self.read - np.einsum("tka,ta->tk", self.basis, fitted)) ** 2).sum(axis=1) / self.sigma**2

    def free(self, covariance: np.ndarray, tick: int) -> float:
        """Degrees of freedom that a fit of `covariance` (B, B) leaves these readings around a tick."""
        bent = np.einsum("ka,ab,kb->", self.basis[tick], covariance, self.basis[tick]) / self.sigma**2
        return max(float((self.basis[tick] != 0).any(axis=1).sum() - bent), 1e-9)
