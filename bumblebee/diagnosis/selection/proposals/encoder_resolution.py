"""Encoders that read in steps: seen in the readings themselves, not in the motion.

Readings on a grid of step s add up in phase at the frequency 1 / s: |mean exp(2 pi i x / s)| is 1 without further noise
and exp(-2 (pi sigma / s)^2) with noise of standard deviation sigma, and nearly 0 where there is no grid. A thousand
readings show a tenth, so a grid is seen under noise of a third of its step. Places where the joint rests would look
like one: readings of places that are crowded weigh less, and a stay within a step counts as one reading. A grid's
overtones fit nearly as well as itself: of steps that fit the largest is taken, also where the joint crosses few of
them, once an overtone has shown that there is a grid.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.simulation import unit_on
from bumblebee.diagnosis.thresholds.proposals import EncoderResolution
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import Effect, single


@dataclass(frozen=True)
class Grid:
    """One joint's readings lie on a grid."""

    joint: str
    step: float
    """[rad]"""
    error: float
    """Standard error of the step [rad]."""
    p: float
    """Rayleigh's test, times the number of frequencies looked at."""


def grids(
    rollouts: Sequence[Rollout],
    noise: Sequence[float] | np.ndarray | None = None,
    rule: EncoderResolution | None = None,
) -> list[Grid]:
    """The joints whose positions were read in steps, with the step.

    `noise` (J,) [rad] is that of the readings: where it is much smaller than a step the readings must lie on the grid,
    and not merely prefer it, as the turning points of a motion do that is repeated.
    """
    rule, joints = rule or EncoderResolution(), rollouts[0].joints
    every = np.concatenate([r.joint_pos for r in rollouts])
    some = every[:: -(-len(every) // rule.samples)]
    most = np.full(len(joints), np.inf) if noise is None else np.asarray(noise, dtype=float)
    found = [_grid(name, some[:, j], float(most[j]), rule) for j, name in enumerate(joints)]
    return [g for g in found if g is not None]


def entries(found: Sequence[Grid], problem: Problem, fit: Fit) -> tuple[list[dict[str, Any]], list[Effect]]:
    """The contract's entries of rounded readings, and the effects; they explain what the servo's rounding does."""
    effects = [single("encoder_quantisation", g.joint, g.step) for g in found]
    if not found:
        return [], []
    sets = [[], fit.effects, *([*fit.effects, e] for e in effects)]
    left = problem.residual(sets) - np.tensordot(fit.nuisance, problem.nuisance, axes=1)
    power = (left**2).mean(axis=(1, 2))
    excess = max(power[0] - power[2:].min(initial=power[1]), 1e-12)
    out = [
        {
            "effect": "encoder_quantisation",
            "where": [g.joint],
            "parameters": {
                "step": {
                    "value": g.step,
                    "ci95": [float(g.step - 1.96 * g.error), float(g.step + 1.96 * g.error)],
                    "nominal": 0.0,
                    "unit": unit_on(problem.plant, "encoder_quantisation", g.joint, "rad"),
                }
            },
            "equivalent": [],
            "explains": float(np.clip((power[1] - after) / excess, 0.0, 1.0)),
            "evidence": {
                "p": g.p,
                "test": "Rayleigh's test of the readings' phases on a grid, Bonferroni over its step",
            },
            "native": False,
        }
        for g, after in zip(found, power[2:], strict=True)
    ]
    return out, effects


def _grid(joint: str, x: np.ndarray, noise: float, rule: EncoderResolution) -> Grid | None:
    """The grid of one joint's readings `x` (N,) [rad] with noise [rad], or None."""
    span = float(np.ptp(x))
    if span < rule.cells * rule.smallest:
        return None
    x = x - x.mean()
    weights = _uncrowded(x, span, rule.places)
    # The mean phase at evenly spaced frequencies is the Fourier transform of a histogram, in cells far below a step.
    cell = rule.smallest / 8
    count = int(2 ** np.ceil(np.log2(span / (rule.dense * cell))))
    counts = np.bincount(np.round((x - x.min()) / cell).astype(int), weights, minlength=count)
    every = np.arange(count // 2 + 1) / (count * cell)
    inside = (every >= rule.cells / span) & (every <= 1.0 / rule.smallest)
    if inside.sum() < 2:
        return None
    frequency, resultant = every[inside], np.abs(np.fft.rfft(counts, count))[inside]
    width = frequency[1] - frequency[0]
    fits = np.where(resultant > rule.on_grid * _left_of(frequency, noise), resultant, 0.0)
    high = np.flatnonzero(fits > max(rule.coarsest * fits.max(), 1e-9))
    if not len(high):
        return None
    first = high[frequency[high] <= frequency[high[0]] + 2 / span]
    best = frequency[first[np.argmax(resultant[first])]]
    value, top = _peak(x, weights, best, width)
    p = len(frequency) * float(np.exp(-min(_readings(x, weights, 1.0 / value) * top**2, 600.0)))
    if p > rule.chance or top < rule.on_grid * _left_of(value, noise):
        return None
    value, top = _undertone(x, weights, (value, top), width, rule)
    return Grid(joint, 1.0 / value, _error(x, weights, top) / value**2, min(1.0, p))


def _error(x: np.ndarray, weights: np.ndarray, resultant: float) -> float:
    """Standard error of a frequency [1/rad]: how well a slope of phase over `x` (N,) is known by readings so weighed.

    Their phase noise is what leaves the resultant.
    """
    noise, away = np.sqrt(-2.0 * np.log(min(resultant, 1 - 1e-6))), x - weights @ x
    return float(noise / (2 * np.pi) * np.sqrt((weights**2 * away**2).sum()) / (weights @ away**2))


def _peak(x: np.ndarray, weights: np.ndarray, frequency: float, width: float) -> tuple[float, float]:
    """The frequency within `width` at which readings (N,) are most in phase, and their resultant there."""
    for span in (width, width / 20):  # of the second round a step is 1/400 of the width
        near = np.linspace(frequency - span, frequency + span, 41)
        fine = np.abs(np.exp(2j * np.pi * np.outer(near, x)) @ weights)
        frequency = float(near[np.argmax(fine)])
    return frequency, float(fine.max())


def _undertone(
    x: np.ndarray, weights: np.ndarray, found: tuple[float, float], width: float, rule: EncoderResolution
) -> tuple[float, float]:
    """The grid of which a grid found is an overtone, if the readings are as much in phase there; else the same.

    Both are a frequency [1/rad] and the resultant there.
    """
    frequency, resultant = found
    for number in rule.overtones:
        if frequency / number < rule.fewest_cells / float(np.ptp(x)):
            continue
        lower = _peak(x, weights, frequency / number, width / number)
        if lower[1] >= resultant:
            return lower
    return found


def _left_of(frequency: np.ndarray | float, noise: float) -> np.ndarray | float:
    """Resultant that noise leaves of a grid."""
    return np.exp(-2.0 * (np.pi * np.minimum(noise, 1e3) * frequency) ** 2)


def _uncrowded(x: np.ndarray, span: float, places: int) -> np.ndarray:
    """Weights (N,) of readings, together 1: those of a place with more than the usual crowd share its weight."""
    place = np.floor((x - x.min()) / (span / places)).astype(int)
    crowd = np.bincount(place)
    usual = float(np.median(crowd[crowd > 0]))
    weights = np.minimum(1.0, usual / crowd[place])
    return weights / weights.sum()


def _readings(x: np.ndarray, weights: np.ndarray, step: float) -> float:
    """How many readings count as independent: a stay at a mark of the grid is one.

    Marks are where the phase of the readings says: between two of them noise alone would end a stay at every reading.
    """
    phase = np.angle(np.exp(2j * np.pi * x / step) @ weights) / (2 * np.pi)
    stay = np.concatenate(([0], np.cumsum(np.abs(np.diff(np.round(x / step - phase))) > 0)))
    together = np.bincount(stay, weights)
    return float(1.0 / (together**2).sum())
