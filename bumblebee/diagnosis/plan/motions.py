"""Candidate motions: multisines, sweeps, steps, holds, small reversals and jumps about random postures.

Each starts and ends at rest in the start pose: an envelope that grows and dies as a minimum-jerk polynomial multiplies
the way to the posture and the excitation about it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bumblebee.diagnosis.plan.config import Gain
from bumblebee.diagnosis.plan.limits import Limits
from bumblebee.diagnosis.thresholds.plan import Motions

_DECLARED = Gain()
FAMILIES = ("multisine", "sweep", "steps", "holds", "reversals", "jumps")


@dataclass(frozen=True, eq=False)
class Motion:
    """One candidate run of T ticks."""

    number: int
    family: str
    text: str
    """Description in words."""
    gain: Gain
    """Factors on the servos' gains."""
    home: np.ndarray
    """(J,) start pose."""
    shape: np.ndarray
    """(T, J) way from the start pose at amplitude 1 [rad, m]."""
    amplitude: np.ndarray
    """(J,) factors up to 1: limits shrink them."""

    @property
    def targets(self) -> np.ndarray:
        """(T, J) position targets [rad, m]."""
        return self.home + self.amplitude * self.shape

    def smaller(self, joints: np.ndarray, factor: float) -> "Motion":
        """The motion with the amplitude of some joints (J,) bool multiplied by `factor`; of all, where it is none."""
        some = joints if joints.any() else np.ones_like(joints)
        return replace(self, amplitude=np.where(some, factor * self.amplitude, self.amplitude))


@dataclass(frozen=True, eq=False)
class Scope:
    """Within what motions are drawn."""

    home: np.ndarray
    """(J,)."""
    moved: np.ndarray
    """(J,) bool."""
    support: np.ndarray
    """(J,) bool: joints between a standing base and its feet."""
    limits: Limits
    rate: float
    """[Hz]"""
    seconds: float
    rule: Motions

    @property
    def time(self) -> np.ndarray:
        """(T,) [s]."""
        return np.arange(max(2, round(self.seconds * self.rate))) / self.rate


def smooth_step(share: np.ndarray) -> np.ndarray:
    """0 to 1 as share goes from 0 to 1, with no speed and no acceleration at either end (minimum jerk)."""
    s = np.clip(share, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


def draw_motion(
    scope: Scope, seed: int, number: int, gain: Gain = _DECLARED, families: Sequence[str] = FAMILIES
) -> Motion:
    """Candidate `number` of a seed; the same whatever else is drawn."""
    rng = np.random.default_rng([seed, number, 19])
    family = families[number % len(families)]
    shape, text = _SHAPES[family](scope, rng)
    posture, radius = _posture(scope, rng)
    small = {"reversals": scope.rule.rocking, "jumps": scope.rule.jumps}
    if family in small:
        radius = np.minimum(radius, rng.uniform(*small[family], len(radius)))
    some = _some(scope, rng)
    envelope = _envelope(scope)[:, None]
    way = envelope * ((posture - scope.home) + radius * some * shape)
    way[:, ~scope.moved] = 0.0
    told = text if some[scope.moved].all() else f"{text}; {int(some.sum())} of {int(scope.moved.sum())} joints excited"
    return Motion(number, family, told, gain, scope.home, way, _slow_enough(scope, way))


def _envelope(scope: Scope) -> np.ndarray:
    """(T,) 0 in the rests at both ends, 1 between the ramps."""
    rule, time = scope.rule, scope.time
    ends = time[-1] - rule.rest
    return smooth_step((time - rule.lead) / rule.ramp) * smooth_step((ends - time) / rule.ramp)


def _posture(scope: Scope, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Middle (J,) of an excitation and its radius (J,) within the limits, with the share of them that is used."""
    limits, reach = scope.limits, rng.uniform(*scope.rule.reach)
    low = np.where(np.isfinite(limits.low), limits.low, scope.home)
    high = np.where(np.isfinite(limits.high), limits.high, scope.home)
    away = rng.uniform(0, 1) * rng.uniform(-1, 1, len(scope.home))
    posture = scope.home + np.where(away > 0, away * (high - scope.home), away * (scope.home - low))
    radius = reach * np.minimum(high - posture, posture - low)
    small = np.where(scope.support, scope.rule.support_reach, 1.0)
    return scope.home + small * (posture - scope.home), small * radius


def _some(scope: Scope, rng: np.random.Generator) -> np.ndarray:
    """(J,) 0 or 1: which joints are excited; the others hold their posture."""
    share = rng.choice([1.0, 0.6, 0.0])
    some = scope.moved & (rng.random(len(scope.moved)) < share)
    if not some.any():
        some[rng.choice(np.flatnonzero(scope.moved))] = True
    return some.astype(float)


def _slow_enough(scope: Scope, way: np.ndarray) -> np.ndarray:
    """(J,) amplitudes at which the targets keep the speed limit; jumps are the servo's to follow as it can."""
    fastest = np.quantile(np.abs(np.gradient(way, 1.0 / scope.rate, axis=0)), scope.rule.mostly, axis=0)
    return np.minimum(1.0, scope.limits.speed / np.maximum(fastest, 1e-12))


def _multisine(scope: Scope, rng: np.random.Generator) -> tuple[np.ndarray, str]:
    rule, time, joints = scope.rule, scope.time, len(scope.home)
    low, high = rule.rates[rng.integers(len(rule.rates))]
    rate = rng.uniform(low, high, (rule.harmonics, 1, joints))
    size = rng.uniform(0.3, 1.0, rate.shape)
    phase = rng.uniform(0, 2 * np.pi, rate.shape)
    wave = (size * np.sin(2 * np.pi * rate * time[:, None] + phase)).sum(axis=0)
    return _unit(wave), f"{rule.harmonics} sines a joint, {low:g} to {high:g} Hz"


def _sweep(scope: Scope, rng: np.random.Generator) -> tuple[np.ndarray, str]:
    """To and fro at constant speed, with rounded corners."""
    rule, time, joints = scope.rule, scope.time, len(scope.home)
    low, high = rule.rates[rng.integers(len(rule.rates))]
    rate, phase = rng.uniform(low, 0.5 * (low + high), joints), rng.uniform(0, 2 * np.pi, joints)
    wave = np.arcsin(0.98 * np.sin(2 * np.pi * rate * time[:, None] + phase))
    return _unit(wave), f"to and fro at constant speed, {low:.2g} to {0.5 * (low + high):.2g} Hz"


def _levels(scope: Scope, rng: np.random.Generator, move: tuple[float, float], hold: tuple[float, float]) -> np.ndarray:
    """(T, J) random levels, each reached by a minimum-jerk move and held, in times [s] drawn from two spans."""
    time, joints = scope.time, len(scope.home)
    out, at, level = np.zeros((len(time), joints)), 0.0, np.zeros(joints)
    while at < time[-1]:
        moving, held, new = rng.uniform(*move), rng.uniform(*hold), rng.uniform(-1, 1, joints)
        part = time >= at
        out[part] = level + smooth_step((time[part] - at) / moving)[:, None] * (new - level)
        at, level = at + moving + held, new
    return out


def _steps(scope: Scope, rng: np.random.Generator) -> tuple[np.ndarray, str]:
    return _levels(scope, rng, (0.15, 0.4), (0.2, 0.7)), "quick moves between random levels, held 0.2 to 0.7 s"


def _holds(scope: Scope, rng: np.random.Generator) -> tuple[np.ndarray, str]:
    return _levels(scope, rng, (0.5, 0.9), (0.5, 1.2)), "slow moves between random postures, held 0.5 to 1.2 s"


def _reversals(scope: Scope, rng: np.random.Generator) -> tuple[np.ndarray, str]:
    rate = rng.uniform(0.5, 2.5, len(scope.home))
    wave = np.sin(2 * np.pi * rate * scope.time[:, None] + rng.uniform(0, 2 * np.pi, len(rate)))
    return wave, "small reversals about a posture, 0.5 to 2.5 Hz"


def _jumps(scope: Scope, rng: np.random.Generator) -> tuple[np.ndarray, str]:
    """(T, J) levels of 1 and -1, each reached in one tick: what delays, lags and filters show in."""
    time, out = scope.time, np.empty((len(scope.time), len(scope.home)))
    for j in range(out.shape[1]):
        turns = np.cumsum(rng.uniform(0.12, 0.5, int(time[-1] / 0.12) + 2))
        out[:, j] = 1.0 - 2.0 * (np.searchsorted(turns, time) % 2)
    return out, "small jumps of the target, held 0.1 to 0.5 s"


def _unit(wave: np.ndarray) -> np.ndarray:
    return wave / np.maximum(np.abs(wave).max(axis=0), 1e-12)


_SHAPES: dict[str, Callable[[Scope, np.random.Generator], tuple[np.ndarray, str]]] = {
    "multisine": _multisine,
    "sweep": _sweep,
    "steps": _steps,
    "holds": _holds,
    "reversals": _reversals,
    "jumps": _jumps,
}
