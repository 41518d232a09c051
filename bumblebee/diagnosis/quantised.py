"""Encoders that read in steps: seen in the readings themselves, not in the motion.

Readings on a grid of step s add up in phase at the frequency 1 / s: |mean exp(2 pi i x / s)| is 1 without further noise
and exp(-2 (pi sigma / s)^2) with noise of standard deviation sigma, and nearly 0 where there is no grid.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bumblebee.diagnosis.fit import Fit
from bumblebee.diagnosis.problem import Problem
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import Effect, single

_SAMPLES = 1500
_SMALLEST, _CELLS = 5e-4, 20  # a step is at least half a milliradian, and the joint crosses at least so many
_IN_PHASE = 0.5
_ON_GRID = 0.8  # of the resultant that the noise leaves of a grid
_ABOVE = 4.0  # times the typical resultant of other frequencies
_DENSE = 0.25  # of the width of a peak


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


def grids(rollouts: Sequence[Rollout], noise: Sequence[float] | np.ndarray | None = None) -> list[Grid]:
    """The joints whose positions were read in steps, with the step.

    `noise` (J,) [rad] is that of the readings: where it is much smaller than a step the readings must lie on the grid,
    and not merely prefer it, as the turning points of a motion do that is repeated.
    """
    joints = rollouts[0].joints
    every = np.concatenate([r.joint_pos for r in rollouts])
    some = every[np.unique(np.linspace(0, len(every) - 1, _SAMPLES).round().astype(int))]
    most = np.full(len(joints), np.inf) if noise is None else np.asarray(noise, dtype=float)
    found = [_grid(name, some[:, j], float(most[j])) for j, name in enumerate(joints)]
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
                    "unit": "rad",
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


def _grid(joint: str, x: np.ndarray, noise: float) -> Grid | None:
    span = float(np.ptp(x))
    if span < _CELLS * _SMALLEST:
        return None
    x = x - x.mean()
    # The mean phase at evenly spaced frequencies is the Fourier transform of a histogram, in cells far below a step.
    cell = _SMALLEST / 8
    count = int(2 ** np.ceil(np.log2(span / (_DENSE * cell))))
    counts = np.bincount(np.round((x - x.min()) / cell).astype(int), minlength=count) / len(x)
    every = np.arange(count // 2 + 1) / (count * cell)
    inside = (every >= _CELLS / span) & (every <= 1.0 / _SMALLEST)
    frequency, resultant = every[inside], np.abs(np.fft.rfft(counts, count))[inside]
    width = frequency[1] - frequency[0]
    # The coarsest grid that fits: its multiples in frequency fit as well.
    high = np.flatnonzero(resultant > max(_IN_PHASE, _ABOVE * float(np.median(resultant))))
    if not len(high):
        return None
    first = high[frequency[high] <= frequency[high[0]] + 2 / span]
    best = frequency[first[np.argmax(resultant[first])]]
    near = np.linspace(best - width, best + width, 41)
    fine = np.abs(_mean_phase(x, near))
    value, top = float(near[np.argmax(fine)]), float(fine.max())
    if top < _ON_GRID * np.exp(-2.0 * (np.pi * noise * value) ** 2):
        return None
    # Phase noise of each reading, and how well a slope of phase over x is known from them.
    spread = np.sqrt(-2.0 * np.log(min(top, 1 - 1e-6)))
    error = spread / (2 * np.pi * np.sqrt(len(x)) * x.std())
    p = min(1.0, len(frequency) * float(np.exp(-min(len(x) * top**2, 600.0))))
    return Grid(joint, 1.0 / value, float(error / value**2), p)


def _mean_phase(x: np.ndarray, frequency: np.ndarray) -> np.ndarray:
    return np.exp(2j * np.pi * np.outer(frequency, x)).mean(axis=1)
