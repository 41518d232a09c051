"""Whitening: what sensor noise does to a window's residual, by simulation from perturbed starts.

The residual of a window has the noise of its readings and, larger by far in contact, what the start's noise has become.
The second part is sampled: K perturbed starts give K differences. Their signs come from a Hadamard matrix, each start
coordinate one of its columns: all coordinates move at once, by one standard deviation, yet where the simulation is
linear the K differences have the propagated covariance exactly, without the error of a random sample. Where it is not
(contact), a part of the covariance is shrunk to its diagonal. The differences' mean is the bias that a noisy start
leaves behind kinks and contacts; it is taken out of the residual.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import hadamard

from bumblebee.diagnosis.plant import Plant
from bumblebee.diagnosis.signals import Layout, conjugate, from_rotation_vector, multiply, rotate
from bumblebee.diagnosis.simulate import Starts, residuals
from bumblebee.diagnosis.variation import Variation
from bumblebee.diagnosis.windows import Windows

_SHRINK = 0.9
# Noise of a base height that is not measured but taken from stance [m].
_HEIGHT_NOISE = 0.002


@dataclass(frozen=True, eq=False)
class Whitener:
    """Inverse Cholesky factors of W windows; M = N * D."""

    factor: np.ndarray
    """(W, M, M) lower triangular: whitened = factor @ residual."""
    bias: np.ndarray
    """(W, M) mean residual that noise in the start leaves."""
    valid: np.ndarray
    """(W,) windows whose simulations stayed finite."""
    moved: np.ndarray
    """(K, W, M) whitened change of the residual from K perturbed starts, less its mean: what noise alone looks like."""

    def part(self, keep: np.ndarray) -> "Whitener":
        """The whitener of the windows at the indices or mask `keep`."""
        return Whitener(self.factor[keep], self.bias[keep], self.valid[keep], self.moved[:, keep])

    def __call__(self, residual: np.ndarray, centre: bool = True) -> np.ndarray:
        """Whiten residuals (..., W, N, D) -> (..., W, M); differences of residuals are whitened with centre=False."""
        flat = residual.reshape(*residual.shape[:-2], -1)
        flat = np.nan_to_num(flat, nan=0.0)
        if centre:
            flat = flat - self.bias
        return np.matmul(self.factor, flat[..., None])[..., 0]


def perturbed_starts(
    plant: Plant, layout: Layout, windows: Windows, sigma: np.ndarray, rng: np.random.Generator
) -> Starts:
    """Start states as the sensors might have read them, (K, W, .), K a power of two."""
    sources = [*layout.slices] + (["height"] if plant.floating and "base_pos" not in layout.slices else [])
    widths = [layout.slices[s].stop - layout.slices[s].start if s in layout.slices else 1 for s in sources]
    signs = _balanced_signs(len(windows), sum(widths), rng)
    parts = dict(zip(sources, np.split(signs, np.cumsum(widths)[:-1], axis=-1), strict=True))
    move = {s: parts[s] * (sigma[layout.slices[s]] if s in layout.slices else _HEIGHT_NOISE) for s in sources}
    qpos = np.repeat(windows.qpos[None], len(signs), axis=0)
    qvel = np.repeat(windows.qvel[None], len(signs), axis=0)
    qpos[..., plant.qpos] += move["joint_pos"]
    qvel[..., plant.dof] += move["joint_vel"]
    if plant.floating:
        q, v = plant.base_qpos, plant.base_dof
        quat = qpos[..., q + 3 : q + 7]
        speed_b = rotate(conjugate(quat), qvel[..., v : v + 3]) + move["base_lin_vel"]
        quat = multiply(quat, from_rotation_vector(move["base_rot"]))
        qpos[..., q + 3 : q + 7] = quat
        qvel[..., v : v + 3] = rotate(quat, speed_b)
        qvel[..., v + 3 : v + 6] += move["base_ang_vel"]
        if "base_pos" in move:
            qpos[..., q : q + 3] += move["base_pos"]
        else:
            qpos[..., q + 2 : q + 3] += move["height"]
    return Starts(qpos, qvel)


def _balanced_signs(windows: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Signs (K, W, count) whose columns are orthogonal and sum to zero in every window."""
    size = 1 << int(np.ceil(np.log2(count + 1)))
    table = hadamard(size)[:, 1:].astype(float)
    columns = np.argsort(rng.random((windows, size - 1)), axis=1)[:, :count]
    flips = rng.choice([-1.0, 1.0], size=(windows, count))
    return table[:, columns] * flips


def fit_whitener(
    plant: Plant,
    layout: Layout,
    windows: Windows,
    variation: Variation,
    sigma: np.ndarray,
    step: float,
    rng: np.random.Generator,
) -> Whitener:
    """The whitener of `windows` for the model `variation` and sensor noise `sigma` (D,)."""
    starts = perturbed_starts(plant, layout, windows, sigma, rng)
    base = residuals(plant, layout, windows, [variation], step)[0]
    moved = residuals(plant, layout, windows, [variation], step, starts) - base
    valid = np.isfinite(moved).all(axis=(0, 2, 3)) & np.isfinite(base).all(axis=(1, 2))
    moved = np.nan_to_num(moved).reshape(len(moved), len(windows), -1)
    bias = moved.mean(axis=0)
    reading = np.broadcast_to(np.tile(sigma**2, windows.measured.shape[1]), bias.shape)
    factor = _factors(moved - bias, reading)
    white = np.matmul(factor, (moved - bias).transpose(1, 2, 0)).transpose(2, 0, 1).astype(np.float32)
    return Whitener(factor, bias, valid, white)


def null_draws(whitener: Whitener, sigma: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Whitened residuals (K, W, M) of a complete model: noise `sigma` (D,) in the readings and in the starts.

    Each window's perturbed starts come in an order of its own.
    """
    count, windows, size = whitener.moved.shape
    order = np.argsort(rng.random((count, windows)), axis=0)
    starts = np.take_along_axis(whitener.moved, order[..., None], axis=0)
    reading = np.tile(sigma, size // len(sigma)) * rng.standard_normal((count, windows, size))
    return starts + np.matmul(whitener.factor, reading.transpose(1, 2, 0)).transpose(2, 0, 1)


def _factors(moved: np.ndarray, reading: np.ndarray) -> np.ndarray:
    """Inverse Cholesky factors (W, M, M) of shrunk covariance of `moved` (K, W, M) plus diag(`reading`) (W, M)."""
    samples, windows, size = moved.shape
    out = np.empty((windows, size, size))
    for w in range(windows):
        # Scale first: signals of different units would spoil the factor's condition.
        scale = np.sqrt(reading[w] + moved[:, w].var(axis=0))
        x = moved[:, w] / scale
        covariance = _SHRINK * (x.T @ x) / samples
        diagonal = (1 - _SHRINK) * (x**2).sum(axis=0) / samples + reading[w] / scale**2
        covariance[np.diag_indices(size)] += diagonal
        out[w] = np.linalg.inv(np.linalg.cholesky(covariance)) / scale
    return out
