"""Sensor noise from the logs themselves: what is left of a signal after its fourth difference, where it is calm.

A smooth signal has almost no fourth difference, white noise of variance s^2 has 70 s^2. The lower quartile over
short blocks keeps fast motion and impacts out; a signal that repeats itself is quantised, and its step sets a floor.
A velocity that reads the same from end to end says nothing of its noise: it is as good as one made from positions.
"""

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2

from bumblebee.diagnosis.simulation import Layout, measured_readings, smallest_moves
from bumblebee.diagnosis.thresholds.dataset import Noise
from bumblebee.measured.rollout import Rollout
from bumblebee.quaternions import conjugate, multiply, rotation_vector

_PLACES = ("joint_pos", "base_rot", "base_pos")
_RATES = {"joint_vel": "joint_pos", "base_ang_vel": "base_rot", "base_lin_vel": "base_pos"}


def estimate_noise(rollouts: Sequence[Rollout], layout: Layout, rule: Noise) -> np.ndarray:
    """Standard deviation of the white part of every signal, (D,)."""
    powers, steps = [], []
    for rollout in rollouts:
        readings, quat = measured_readings(rollout, layout)
        if quat is not None:
            turn = rotation_vector(multiply(conjugate(quat[:-1]), quat[1:]))
            readings[1:, layout.slices["base_rot"]] = np.cumsum(turn, axis=0)
        powers.append(_block_powers(rollout.time, readings, rule.block))
        steps.append(smallest_moves(readings, rule))
    every = np.concatenate([p for p in powers if len(p)]) if any(len(p) for p in powers) else np.zeros((1, layout.size))
    dof = rule.block * rule.freedom
    sigma = np.sqrt(np.quantile(every, rule.quantile, axis=0) * dof / chi2.ppf(rule.quantile, dof))
    known = np.ma.median(np.ma.masked_invalid(steps), axis=0)  # by the rollouts in which a signal moves
    sigma = np.maximum(sigma, known.filled(0.0) / np.sqrt(12))
    for name, part in layout.slices.items():
        # A channel far calmer than its kin was probably still: it is no better a sensor than the others.
        kin = np.median(sigma[part])
        floor = rule.least_place if name in _PLACES else rule.least
        sigma[part] = np.maximum(sigma[part], max(rule.kin * kin, floor))
    hz = float(np.median([rollout.control_hz for rollout in rollouts]))
    for name, of in _RATES.items():
        if name in layout.slices and of in layout.slices:
            part = layout.slices[name]
            least = np.where(np.ma.getmaskarray(known)[part], hz * sigma[layout.slices[of]], 0.0)
            sigma[part] = np.maximum(sigma[part], least)
    return sigma


def _block_powers(time: np.ndarray, readings: np.ndarray, block: int) -> np.ndarray:
    """Mean square of the normalised fourth difference in blocks of `block` rows, (blocks, D).

    On uneven stamps it is the divided difference: five weights that no cubic passes, of length one.
    """
    rows = np.arange(len(time) - 4)[:, None] + np.arange(5)
    apart = time[rows][:, :, None] - time[rows][:, None, :] + np.eye(5)
    weights = 1.0 / apart.prod(axis=2)
    weights /= np.linalg.norm(weights, axis=1, keepdims=True)
    fourth = np.einsum("tk,tkd->td", weights, readings[rows])
    blocks = len(fourth) // block
    return (fourth[: blocks * block].reshape(blocks, block, readings.shape[1]) ** 2).mean(axis=1)
