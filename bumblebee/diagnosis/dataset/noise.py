"""Sensor noise from the logs themselves: what is left of a signal after its fourth difference, where it is calm.

A smooth signal has almost no fourth difference, white noise of variance s^2 has 70 s^2. The lower quartile over
short blocks keeps fast motion and impacts out; a signal that repeats itself is quantised, and its step sets a floor.
"""

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2

from bumblebee.diagnosis.simulation import Layout, conjugate, measured_readings, multiply, rotation_vector
from bumblebee.measured.rollout import Rollout

_BLOCK = 24
# Successive fourth differences are correlated: a block is worth this share of its length in degrees of freedom.
_DOF_SHARE = 1 / 2.63
_FLOOR = {"joint_pos": 1e-6, "base_rot": 1e-6, "base_pos": 1e-6}


def estimate_noise(rollouts: Sequence[Rollout], layout: Layout) -> np.ndarray:
    """Standard deviation of the white part of every signal, (D,)."""
    powers, steps = [], []
    for rollout in rollouts:
        readings, quat = measured_readings(rollout, layout)
        if quat is not None:
            turn = rotation_vector(multiply(conjugate(quat[:-1]), quat[1:]))
            readings[1:, layout.slices["base_rot"]] = np.cumsum(turn, axis=0)
        powers.append(_block_powers(rollout.time, readings))
        steps.append(_quantisation(readings))
    every = np.concatenate([p for p in powers if len(p)]) if any(len(p) for p in powers) else np.zeros((1, layout.size))
    dof = _BLOCK * _DOF_SHARE
    sigma = np.sqrt(np.quantile(every, 0.25, axis=0) * dof / chi2.ppf(0.25, dof))
    sigma = np.maximum(sigma, np.median(steps, axis=0) / np.sqrt(12))
    for name, part in layout.slices.items():
        # A channel far calmer than its kin was probably still: it is no better a sensor than the others.
        kin = np.median(sigma[part])
        sigma[part] = np.maximum(sigma[part], max(0.3 * kin, _FLOOR.get(name, 1e-5)))
    return sigma


def _block_powers(time: np.ndarray, readings: np.ndarray) -> np.ndarray:
    """Mean square of the normalised fourth difference in blocks, (blocks, D).

    On uneven stamps it is the divided difference: five weights that no cubic passes, of length one.
    """
    rows = np.arange(len(time) - 4)[:, None] + np.arange(5)
    apart = time[rows][:, :, None] - time[rows][:, None, :] + np.eye(5)
    weights = 1.0 / apart.prod(axis=2)
    weights /= np.linalg.norm(weights, axis=1, keepdims=True)
    fourth = np.einsum("tk,tkd->td", weights, readings[rows])
    blocks = len(fourth) // _BLOCK
    return (fourth[: blocks * _BLOCK].reshape(blocks, _BLOCK, -1) ** 2).mean(axis=1)


def _quantisation(readings: np.ndarray) -> np.ndarray:
    """Step of a quantised signal, (D,): its smallest move, where it often does not move at all; else 0."""
    moves = np.abs(np.diff(readings, axis=0))
    out = np.zeros(readings.shape[1])
    for column, steps in enumerate(moves.T):
        nonzero = steps[steps > 1e-7]
        if len(nonzero) > 10 and len(nonzero) < 0.95 * len(steps):
            out[column] = np.quantile(nonzero, 0.05)  # the smallest itself may be rounding
    return out
