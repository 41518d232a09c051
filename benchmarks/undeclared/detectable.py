"""How small an effect can be and still be seen: its minimal detectable size in given data.

Windows of 0.1 s of the true robot are compared with two robots, restarted from noisy readings and given the same
commands: one without the effect and one with it, at its true size. What the effect remembers of commands and readings
is known; what none of them shows (on which side play touches, how far a shaft is twisted, how a mount leans, what an
encoder rounded off) is guessed from noisy readings (`resume`). How far the two robots come apart is whitened,
window by window, by the covariance of what noise in that window's start and readings makes of such a comparison, and
what is guessed wrong, over all windows. What the declared model at 5 ms does otherwise than the same robot at 1 ms is
taken out, joint by joint, with a free amplitude: an effect that looks like another integrator cannot be told from it.

The summed square, or what wrong guesses leave of it, is the chi-square of the best test of this one effect that starts
from readings; the minimal detectable size is where it is 25: five standard errors, enough to be seen four times in five
by a test that shares a false-alarm rate of 0.5 % among some hundred candidates. It is computed as the product of
differences from independent draws of the starts' noise. In contact a start a micrometre away can end elsewhere, and a
single draw, or a start without noise, takes such a jump for the effect's doing; in the mean over the noise, which is
all that a test can know, it is not. Of many windows some are compared so, drawn with a probability that grows with what
a first draw shows there.

Two effects show otherwise than by a course. A command is lost at a tick that nobody knows: the likelihood is summed
over whether it was. An encoder's steps show in its readings as such, whatever moved the joint: the larger of the two
chi-squares counts.

Up to version 3 of the suite a size followed from the whole square without the effect, which counts as seen what not
even the true law explains; up to version 5 from windows without noise in their starts and one covariance for all. On a
standing G1 that took an offset of the IMU of 2e-6 rad for detectable, and friction whose true chi-square was 1.
"""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from benchmarks.undeclared.flight import NOISE, Flight
from benchmarks.undeclared.restarts import HORIZON, TICKS, Windows, windows_of
from bumblebee.stand_in.undeclared.declared import Declared

CHI2 = 25.0
_MOST, _COMPARED, _DRAWS = 160, 32, 3  # windows looked at, of these compared on a floating base, draws of their noise
_NULL_WINDOWS, _NULL_DRAWS = 32, 20  # of the robot without effects
_EVENLY = 0.5  # share of the compared windows that are drawn whatever they show


@dataclass(frozen=True, eq=False)
class Eye:
    """A robot with its sensors."""

    robot: Declared
    model: mujoco.MjModel
    noise: float
    """Times the sensors' noise."""
    root: np.ndarray
    """(E, E): whitens what windows' own covariances leave unwhitened."""


def make_eye(robot: Declared, null: Flight, noise: float, rng: np.random.Generator) -> Eye:
    """From the motion of the robot without effects: how its restarts at 1 ms differ from what 5 ms make of noise.

    In contact a window's covariance, from small steps in 5 ms, is up to ten times too small in some directions.
    """
    model = robot.spec.compile()
    own = windows_of(robot, model, noise, null, _NULL_WINDOWS)
    rows = np.repeat(np.arange(len(own.picks)), _NULL_DRAWS)
    if not len(rows):
        return Eye(robot, model, noise, np.eye(len(TICKS) * len(own.sigma)))
    some = own.part(rows)
    left = np.einsum("wij,wj->wi", own.roots(rng)[rows], some.without(some.starts(rng)) + some.read(rng))
    left = left[np.isfinite(left).all(axis=1)]
    count, size = left.shape
    if count < 3 * size:
        return Eye(robot, model, noise, np.eye(size))
    # The inverse of a covariance of few samples is too large by this share in the mean.
    fair = (count - size - 2) / count
    return Eye(robot, model, noise, np.sqrt(fair) * np.linalg.inv(np.linalg.cholesky(left.T @ left / count)))


def chi_square(eye: Eye, flight: Flight) -> float:
    """By how much a flight's whitened square falls if its effects are in the model, for all its ticks."""
    every = windows_of(eye.robot, eye.model, eye.noise, flight, _MOST)
    ticks = int(np.minimum(flight.alive, len(flight.qpos)).sum())
    if not len(every.picks):
        return np.inf
    rng = np.random.default_rng(0)  # the same noise for every size
    off = every.starts(rng)
    without = every.without(off)
    apart = without - every.known(off, rng, guess=False)
    good = np.isfinite(apart).all(axis=1)
    shown = ((np.where(good[:, None], apart, 0.0) / np.tile(every.sigma, len(TICKS))) ** 2).sum(axis=1)
    kept, share = _sampled(shown, _COMPARED if eye.robot.floating else _MOST)
    some = every.part(kept)
    gain = _gain(eye, some, without[kept] - some.declared(off[kept]), share, rng)
    gain *= ticks / HORIZON / max(good.sum(), 1)
    return max([gain, *(_of_grid(step, eye.noise * NOISE["q"], ticks) for step in _grids(flight))])


def _gain(eye: Eye, windows: Windows, numeric: np.ndarray, share: np.ndarray, rng: np.random.Generator) -> float:
    """Chi-square of the windows, each counted as often as one stands for others: 1 / `share` (W,)."""
    bad = ~np.isfinite(numeric).all(axis=1)
    weight = np.where(bad, 0.0, 1.0 / np.sqrt(share))
    offs = [windows.starts(rng) for _ in range(_DRAWS)]
    known = [windows.known(off, rng, guess=False) for off in offs]
    apart = np.nan_to_num(np.stack([windows.without(off) - k for off, k in zip(offs, known, strict=True)]))
    wrong = np.zeros_like(apart)
    if windows.guesses:
        guessed = [windows.known(off, rng, guess=True) for off in offs]
        wrong = np.nan_to_num(np.stack(guessed) - np.stack(known))
    roots = windows.roots(rng, np.einsum("rwi,rwj->ij", wrong, wrong) / wrong.shape[0] / wrong.shape[1])
    roots = np.einsum("ij,wjk->wik", eye.root, roots)
    span = _span(eye, roots, np.where(bad[:, None], 0.0, numeric), weight)

    def whitened(error: np.ndarray) -> np.ndarray:
        flat = (np.einsum("wij,rwj->rwi", roots, error) * weight[:, None]).reshape(len(error), -1)
        return (flat - (flat @ span.T) @ span).reshape(error.shape)

    told, is_ = whitened(apart - wrong), whitened(apart)
    chance = min((law.chance for law in windows.flight.laws[0]), default=1.0)
    if chance < 1.0:
        own = _product(is_, is_) * share
        return float((2 * np.logaddexp(np.log1p(-chance), np.log(chance) + 0.5 * own) / share).sum())
    along, power = float(_product(told, is_).sum()), float(_product(told, told).sum())
    return along**2 / power if along > 0 and power > 0 else 0.0


def _product(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Products (W,) of differences (R, W, E) from different draws, in the mean over the pairs of draws."""
    every = (one.sum(axis=0) * other.sum(axis=0)).sum(axis=1)
    return (every - (one * other).sum(axis=(0, 2))) / (len(one) * (len(one) - 1))


def _span(eye: Eye, roots: np.ndarray, numeric: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Orthonormal rows (B, W E): whitened numerical differences (W, E) of each joint and of the base."""
    basis = []
    for rows in _groups(eye):
        part = np.zeros_like(numeric)
        part[:, rows] = numeric[:, rows]
        basis.append((np.einsum("wij,wj->wi", roots, part) * weight[:, None]).ravel())
    return np.linalg.svd(np.array(basis), full_matrices=False)[2]


def _sampled(shown: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Indices of at most `most` windows, and with what probability each was drawn: half even, half by `shown` (W,)."""
    if len(shown) <= most:
        return np.arange(len(shown)), np.ones(len(shown))
    share = np.full(len(shown), 1.0 / len(shown))
    if shown.sum() > 0:
        share = _EVENLY * share + (1 - _EVENLY) * shown / shown.sum()
    ends = np.cumsum(most * share)
    counts = np.diff(np.floor(np.concatenate(([0.0], ends)) + 0.5))
    kept = np.flatnonzero(counts)
    return kept, np.minimum(most * share[kept], 1.0)


def _grids(flight: Flight) -> list[float]:
    """Steps [rad] of the encoders that have some."""
    return [law.grid for law in flight.laws[0] if law.grid > 0]


def _of_grid(step: float, sigma: float, count: int) -> float:
    """Twice the expected log-likelihood ratio of `count` readings on a grid, with noise `sigma`, against none."""
    phase = (np.arange(400) + 0.5) / 400 * step
    near = np.arange(-int(np.ceil(8 * sigma / step)) - 1, int(np.ceil(8 * sigma / step)) + 2) * step
    density = np.exp(-0.5 * ((phase[:, None] - near) / sigma) ** 2).sum(axis=1)
    density /= density.mean()
    return float(2 * count * (density * np.log(np.maximum(density, 1e-300))).mean())


def minimal_size(
    eye: Eye, run: Callable[[float], Flight], first: float, most: float, least: float = 0.0, tries: int = 7
) -> float:
    """Size at which chi-square is `CHI2`: infinite if `most` is not seen, by its square law if `least` is."""
    size, low, high = min(first, most), None, None
    tried: list[tuple[float, float]] = []
    for _ in range(tries):
        value = max(chi_square(eye, run(size)), 1e-3)
        if size <= least or 0.5 * CHI2 < value < 2 * CHI2:
            return float(size * (CHI2 / value) ** (1 / max(_power([*tried, (size, value)]), 1.5)))
        if value < CHI2:
            low = size if low is None else max(low, size)
            if size >= most:
                return np.inf
        else:
            high = size if high is None else min(high, size)
        tried.append((size, value))
        size = max(_next(tried, low, high, most), least)
    return float(np.sqrt((low or high) * (high or low)))


def _power(tried: list[tuple[float, float]]) -> float:
    """How chi-square grows with the size, by the last two that were tried: with its square if only one was."""
    if len(tried) < 2 or tried[-2][0] == tried[-1][0]:
        return 2.0
    (before, low), (size, value) = tried[-2:]
    slope = np.log(value / low) / np.log(size / before)
    return float(np.clip(slope, 0.7, 8.0)) if np.isfinite(slope) else 2.0


def _next(tried: list[tuple[float, float]], low: float | None, high: float | None, most: float) -> float:
    """The next size to try: by the power law through the last two, inside what is known."""
    size, value = tried[-1]
    wanted = size * float(np.clip((CHI2 / value) ** (1 / _power(tried)), 0.02, 20.0))
    if low is not None and high is not None:
        reach = (high / low) ** 0.2
        wanted = float(np.clip(wanted, low * reach, high / reach))
    return min(wanted, most)


def _groups(eye: Eye) -> list[list[int]]:
    """Columns of the comparison that belong to one joint, and those of the base."""
    nv, ticks = eye.model.nv, 2 * len(TICKS)
    joints = len(eye.robot.joints)
    groups = [[part * nv + dof for part in range(ticks)] for dof in range(nv - joints, nv)]
    if eye.robot.floating:
        groups.append([part * nv + dof for part in range(ticks) for dof in range(6)])
    return groups
