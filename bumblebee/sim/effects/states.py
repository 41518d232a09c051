"""States of the terms of discovered effects: quantities that follow from a joint's past, one number a world.

- `rested(T, d)` is 0 on a joint that moves and grows to 1 within T seconds of rest; d radians of motion wear it off:
  da/dt = (1 - a) / T - a abs(v) / d.
- `slewed(r, T)` follows the servo's target: every T seconds, when a command comes, it moves by at most r T.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.effects.terms import Term

_EPS = 1e-6  # [s]: clocks are sums of steps


@dataclass(frozen=True)
class State:
    """One remembered number."""

    column: int
    """Column of the joint."""
    key: str
    """As terms look it up."""
    numbers: tuple[float, ...]

    @property
    def rests(self) -> bool:
        """Whether it is `rested`, else `slewed`."""
        return self.key.startswith("rested")

    def first(self, u: np.ndarray) -> np.ndarray:
        """Its value (n,) on joints that have long moved, their targets `u` (n,) long held."""
        return np.zeros_like(u) if self.rests else u

    def at(self, now: np.ndarray, u: np.ndarray, t: np.ndarray, step: float) -> np.ndarray:
        """The value (n,) in the step that begins at the times `t` [s] with the targets `u` [rad]."""
        if self.rests:
            return now
        rate, period = self.numbers
        beats = np.floor((t + _EPS) / period) - np.floor((t - step + _EPS) / period)
        reach = rate * period * beats
        return now + np.clip(u - now, -reach, reach)

    def after(self, now: np.ndarray, v: np.ndarray, step: float) -> np.ndarray:
        """The value (n,) at the end of a `step` [s] at velocities `v` (n,) [rad/s]."""
        if not self.rests:
            return now
        time, way = self.numbers
        rate = 1.0 / time + np.abs(v) / way
        end = 1.0 / (time * rate)
        return end + (now - end) * np.exp(-rate * step)

    def followed(self, clock: np.ndarray, steps: np.ndarray, v: np.ndarray, u: np.ndarray) -> np.ndarray:
        """The values (..., T) before each of the times `clock` (..., T) [s], `steps` apart, of one joint in some logs.

        Many logs side by side cost hardly more than one; of one log the steps are taken with plain numbers, which is
        faster.
        """
        out = np.empty(v.shape)
        if self.rests:
            time, way = self.numbers
            rate = 1.0 / time + np.abs(v) / way
            end, keep, now = 1.0 / (time * rate), np.exp(-rate * steps), np.zeros(v.shape[:-1])[()]
            for k in range(v.shape[-1]):
                out[..., k] = now
                now = end[..., k] + (now - end[..., k]) * keep[..., k]
            return out
        rate, period = self.numbers
        reaches = rate * period * np.diff(np.floor((clock + _EPS) / period), prepend=-1.0)
        if v.ndim == 1:
            at, targets = float(u[0]), u.tolist()
            for k, reach in enumerate(reaches.tolist()):
                out[k] = at
                at += min(max(targets[k] - at, -reach), reach)
            return out
        now, most = u[..., 0].copy(), np.moveaxis(reaches, -1, 0).copy()
        step, least = np.empty_like(now), -most
        for k, wanted in enumerate(np.moveaxis(u, -1, 0).copy()):
            out[..., k] = now
            np.subtract(wanted, now, out=step)
            np.maximum(step, least[k], out=step)  # `np.clip` takes five times as long on few numbers
            np.minimum(step, most[k], out=step)
            now += step
        return out


def states_of(terms: Sequence[tuple[int, float, Term]]) -> list[State]:
    """The states that the terms (column, coefficient, term) of a model need, each once."""
    found = [State(column, key, numbers) for column, _, term in terms for key, numbers in term.states]
    return list(dict.fromkeys(found))
