"""Set-point that a drive makes of its targets before its servo sees them, in closed form between two commands.

| effect | the set-point y of a target u that is held |
|---|---|
| command_filter | dy/dt = (u - y) / time, a servo's input filter |
| command_rate_limit | dy/dt = rate sgn(u - y) until y = u |
| command_profile | to rest at u in the shortest time with abs(dy/dt) <= speed, abs(d2y/dt2) <= acceleration |

All depend on the targets alone, neither on the joint nor on the torque: the set-point is known in advance where the
targets are. A pure delay before or after them is the same.

Arrays (...) of NumPy, or `sim.device_arrays.DeviceArray`s.
"""

from collections.abc import Sequence

import numpy as np

SETPOINTS = ("command_filter", "command_rate_limit", "command_profile")
"""Effects that a joint can have one of."""
NO_SPEED_LIMIT = 1e3
"""[rad/s, m/s]: faster than any joint, so as good as no limit."""
_LEAST = 1e-12
Values = np.ndarray | float
Moved = tuple[np.ndarray, np.ndarray, np.ndarray]


def advance(
    kind: str, values: Sequence[Values], at: np.ndarray, speed: np.ndarray, target: np.ndarray, time: Values
) -> Moved:
    """The set-point `time` [s] later, the target held.

    Args:
        kind: one of `SETPOINTS`.
        values: the effect's parameters in the catalogue's order, numbers or (...).
        at: the set-point now (...) [rad].
        speed: its speed now (...) [rad/s]; only a profile has one.
        target: what is asked for (...) [rad].
        time: how much later (...) [s], not negative.

    Returns:
        Its integral over the time (...) [rad s], where it is then (...) and its speed (...).
    """
    if kind == "command_filter":
        return _filtered(values[0], at, speed, target, time)
    if kind == "command_rate_limit":
        return _slewed(values[0], at, speed, target, time)
    return _profiled(values[0], values[1], at, speed, target, time)


def _filtered(constant: Values, at: np.ndarray, speed: np.ndarray, target: np.ndarray, time: Values) -> Moved:
    away, keep = target - at, np.exp(-time / constant)
    return target * time - away * constant * (1.0 - keep), target - away * keep, speed


def _slewed(rate: Values, at: np.ndarray, speed: np.ndarray, target: np.ndarray, time: Values) -> Moved:
    away = target - at
    left, way = np.abs(away), np.sign(away)
    moves = np.minimum(time, left / rate)
    return (
        target * time - way * (left * moves - 0.5 * rate * moves**2),
        at + way * np.minimum(rate * moves, left),
        speed,
    )


def _profiled(
    acceleration: Values, limit: Values, at: np.ndarray, speed: np.ndarray, target: np.ndarray, time: Values
) -> Moved:
    """Speed up (or first slow down), cruise, slow down, rest; positions counted in the direction of the first phase."""
    stop = speed * np.abs(speed) / (2.0 * acceleration)
    way = np.where(target - at - stop < 0.0, -1.0, 1.0)
    gone, v = way * (target - at), way * speed
    peak = np.minimum(np.sqrt(np.maximum(acceleration * gone + 0.5 * v**2, 0.0)), np.maximum(limit, v))
    rises, falls = (peak - v) / acceleration, peak / acceleration
    ways = (peak**2 - v**2) / (2.0 * acceleration), peak**2 / (2.0 * acceleration)
    cruises = np.maximum(gone - ways[0] - ways[1], 0.0) / np.maximum(peak, _LEAST)
    area, place, pace, left = 0.0 * gone, 0.0 * gone, v, time
    for lasts, gain in ((rises, acceleration), (cruises, 0.0), (falls, -acceleration)):
        t = np.minimum(np.maximum(left, 0.0), lasts)
        area = area + place * t + 0.5 * pace * t**2 + gain * t**3 / 6.0
        place = place + pace * t + 0.5 * gain * t**2
        pace, left = pace + gain * t, left - lasts
    rests = np.maximum(left, 0.0)
    there = rests > 0.0
    place = np.where(there, gone, place)
    return at * time + way * (area + gone * rests), at + way * place, way * np.where(there, 0.0, pace)
