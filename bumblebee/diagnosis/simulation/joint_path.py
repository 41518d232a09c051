"""The path of a joint without its sensor's noise, for what remembers a path or is where a later reading puts it.

Every reversal counts for a friction that remembers, so noise that is read as motion winds its state back, and a mean
over some ticks leaves out the reversals of the motion itself. Positions and velocities are taken together instead, by
the Kalman smoother of a motion whose acceleration is noise (Rauch, Tung and Striebel 1965), solved as one least-squares
problem with a banded matrix. That noise follows Student's t: a joint that mostly rests is smoothed as one that rests,
and a jerk or an impact in between is kept (Aravkin, Burke and Pillonetto 2014, iteratively reweighted).
"""

from functools import lru_cache

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from bumblebee.diagnosis.thresholds.simulation import JointPath
from bumblebee.measured.rollout import Rollout

_FOURTH = np.array([1.0, -4.0, 6.0, -4.0, 1.0])  # passes no cubic


def joint_path(rollout: Rollout, column: int, rule: JointPath) -> np.ndarray:
    """Positions (T,) [rad, m] of one joint (a column of the log) at the ticks; see `joint_states`."""
    return joint_states(rollout, column, rule)[:, 0]


@lru_cache(maxsize=4096)  # a robot's joints in some hundred rollouts
def joint_states(rollout: Rollout, column: int, rule: JointPath) -> np.ndarray:
    """Positions [rad, m] and velocities (T, 2) of one joint (a column of the log), without the noise of the readings.

    As read where there are too few rows, or steps and sizes too far apart for floating point.
    """
    place, speed = rollout.joint_pos[:, column], rollout.joint_vel[:, column]
    as_read = np.stack((place, speed), axis=1)
    if len(place) < rule.least_rows:
        return as_read
    period = float(np.median(np.diff(rollout.time)))
    read = np.stack((place - place[0], speed * period), axis=1)
    noise = np.maximum(white_noise(read), np.array([rule.least_place, rule.least_speed * period]))
    try:
        states = _smoothed(np.diff(rollout.time) / period, read, noise, rule)
    except np.linalg.LinAlgError:
        return as_read
    return np.stack((place[0] + states[:, 0], states[:, 1] / period), axis=1)


def white_noise(signals: np.ndarray) -> np.ndarray:
    """Standard deviations (D,) of the white part of signals (T, D): their fourth differences' median absolute value."""
    fourth = np.stack([np.convolve(signal, _FOURTH, mode="valid") for signal in signals.T], axis=1)
    normal = 0.6745 * np.linalg.norm(_FOURTH)  # of white noise of deviation 1
    return np.median(np.abs(fourth), axis=0) / normal


def _smoothed(steps: np.ndarray, read: np.ndarray, noise: np.ndarray, rule: JointPath) -> np.ndarray:
    """Positions and velocities (T, 2) by readings of `noise` (2,), `steps` (T - 1,) apart; time is in periods."""
    largest = max(float((np.diff(read[:, 1]) ** 2).mean()), noise[1] ** 2)
    tried = [largest * 10.0**-k for k in range(rule.decades)]
    usual = min(tried, key=lambda s: _doubt(steps, read, noise, np.full(len(steps), s)))
    size = np.full(len(steps), usual)
    for _ in range(rule.rounds):
        states, _ = _solved(steps, read, noise, size)
        size = (rule.freedom * rule.rest * usual + _jerked(steps, states)) / (rule.freedom + 2)
    return _solved(steps, read, noise, size)[0]


def _doubt(steps: np.ndarray, read: np.ndarray, noise: np.ndarray, size: np.ndarray) -> float:
    """-2 log-likelihood of accelerations of these intensities; infinite where it cannot be computed."""
    try:
        return _solved(steps, read, noise, size)[1]
    except np.linalg.LinAlgError:
        return np.inf


def _solved(steps: np.ndarray, read: np.ndarray, noise: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, float]:
    """The most likely states (T, 2) for accelerations of intensities `size` (T - 1,), and these' -2 log-likelihood."""
    count, precision = len(read), 1.0 / noise**2
    bands = np.zeros((4, 2 * count))  # of the symmetric matrix, from the diagonal downward
    bands[0] = np.tile(precision, count)
    weight = _precision(steps) / size
    # The step from (x, v) should lead to (x + v t, v): its precision on the state that it comes to, on both, and on
    # the one that it leaves.
    first = np.stack((weight[0], weight[1]))
    second = np.stack((weight[1], weight[2]))
    left_x, left_v = first, first * steps + second
    bands[0, 0:-2:2] += left_x[0]
    bands[1, 0:-2:2] += left_v[0]
    bands[0, 1:-2:2] += left_v[0] * steps + left_v[1]
    bands[0, 2::2] += weight[0]
    bands[1, 2::2] += weight[1]
    bands[0, 3::2] += weight[2]
    bands[2, 0:-2:2] -= left_x[0]
    bands[3, 0:-2:2] -= left_x[1]
    bands[1, 1:-2:2] -= left_v[0]
    bands[2, 1:-2:2] -= left_v[1]
    right = (read * precision).ravel()
    factor = cholesky_banded(bands, lower=True)
    states = cho_solve_banded((factor, True), right)
    fit = float((read**2 * precision).sum() - right @ states)
    return states.reshape(-1, 2), fit + 2.0 * float(np.log(factor[0]).sum()) + 2.0 * float(np.log(size).sum())


def _precision(steps: np.ndarray) -> np.ndarray:
    """(3, T - 1): xx, xv and vv of the inverse covariance of a step, for white acceleration of intensity 1."""
    return np.stack((12.0 / steps**3, -6.0 / steps**2, 4.0 / steps))


def _jerked(steps: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Square (T - 1,) of what each step differs from an even motion by, as an intensity of its acceleration."""
    x = np.diff(states[:, 0]) - steps * states[:-1, 1]
    v = np.diff(states[:, 1])
    xx, xv, vv = _precision(steps)
    return xx * x**2 + 2.0 * xv * x * v + vv * v**2
