"""Whitening: what sensor noise does to a window's residual, by simulation from perturbed starts.

The residual of a window has the noise of its readings and, larger by far in contact, what the start's noise has become.
The second part is sampled: K perturbed starts give K differences. Their signs come from a Hadamard matrix, each start
coordinate one of its columns: all coordinates move at once, by one standard deviation, yet where the simulation is
linear the K differences have the propagated covariance exactly, without the error of a random sample. Nothing of that
is shrunk: even a tenth of its diagonal is far more than the readings' noise in most directions, and would hide effects
on a robot in contact. Where the simulation is not linear (contact), a part of what the slopes leave is added to the
diagonal.

The differences' mean is what curvature makes of noise. Seen from the measured start the true one is `start - noise`, so
the residual's mean has the opposite sign, and less of it where the true state is known to be milder than a measured one
(feet rest on the floor). How much is left to the fit: the mean is one of its nuisances, it is not subtracted.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import hadamard
from scipy.linalg.lapack import dtrtri

from bumblebee.diagnosis.simulation import (
    Layout,
    Plant,
    Starts,
    Variation,
    Windows,
    residuals,
)
from bumblebee.diagnosis.thresholds.residuals import Whitening
from bumblebee.quaternions import conjugate, from_rotation_vector, multiply, rotate_by_cross


@dataclass(frozen=True, eq=False)
class NoisyWindows:
    """W windows simulated by one model, and the noise of the readings that they start from."""

    plant: Plant
    layout: Layout
    windows: Windows
    variation: Variation
    sigma: np.ndarray
    """(D,) noise of every signal."""
    step: float
    """Step of the simulation [s]."""
    rule: Whitening = field(default_factory=Whitening)

    @property
    def start_noise(self) -> np.ndarray:
        """Standard deviations (C,) of a start's coordinates: the signals', and the height's if it is not one."""
        unmeasured = self.plant.floating and "base_pos" not in self.layout.slices
        return np.concatenate((self.sigma, [self.rule.height_noise])) if unmeasured else self.sigma

    def residuals(self, starts: Starts | None = None) -> np.ndarray:
        """Raw residuals (1, W, N, D), or (K, W, N, D) from K `starts`."""
        return residuals(self.plant, self.layout, self.windows, [self.variation], self.step, starts)


@dataclass(frozen=True, eq=False)
class Whitener:
    """Inverse Cholesky factors of W windows; M = N * D."""

    factor: np.ndarray
    """(W, M, M) lower triangular: whitened = factor @ residual."""
    offset: np.ndarray
    """(W, M) residual that the starts' distance from the measured ones makes; 0 for measured starts."""
    curvature: np.ndarray
    """(W, M) whitened mean change of the residual from noise in the start."""
    valid: np.ndarray
    """(W,) windows whose simulations stayed finite."""
    moved: np.ndarray
    """(K, W, M) whitened change of the residual from K perturbed starts, less its mean: what noise alone looks like."""
    slopes: np.ndarray
    """(W, C, M) whitened change of the residual for a standard deviation of each coordinate of the start."""

    def part(self, keep: np.ndarray) -> "Whitener":
        """The whitener of the windows at the indices or mask `keep`."""
        return Whitener(
            self.factor[keep], self.offset[keep], self.curvature[keep], self.valid[keep], self.moved[:, keep],
            self.slopes[keep],
        )  # fmt: skip

    def __call__(self, residual: np.ndarray, centre: bool = True) -> np.ndarray:
        """Whiten residuals (..., W, N, D) -> (..., W, M); differences of residuals are whitened with centre=False."""
        flat = residual.reshape(*residual.shape[:-2], -1)
        flat = np.nan_to_num(flat, nan=0.0)
        if centre:
            flat = flat - self.offset
        # All residuals of a window at once: the factors are far larger than what they are multiplied with.
        rows = np.moveaxis(flat.reshape(-1, *flat.shape[-2:]), 0, -1)
        return np.moveaxis(np.matmul(self.factor, rows), -1, 0).reshape(flat.shape)

    def on(self, keep: np.ndarray, residual: np.ndarray) -> np.ndarray:
        """Whiten residuals (..., K, N, D) of the windows at the indices `keep` (K,), without copying their factors."""
        flat = np.nan_to_num(residual.reshape(*residual.shape[:-2], -1), nan=0.0) - self.offset[keep]
        return np.stack([flat[..., k, :] @ self.factor[w].T for k, w in enumerate(keep)], axis=-2)


def displaced(plant: Plant, layout: Layout, windows: Windows, move: np.ndarray) -> Starts:
    """The windows' starts moved by `move` (K, W, C), coordinates as `NoisyWindows.start_noise` has them: (K, W, .)."""
    parts = {name: move[..., part] for name, part in layout.slices.items()}
    qpos = np.repeat(windows.qpos[None], len(move), axis=0)
    qvel = np.repeat(windows.qvel[None], len(move), axis=0)
    qpos[..., plant.qpos] += parts["joint_pos"]
    qvel[..., plant.dof] += parts["joint_vel"]
    if plant.floating:
        q, v = plant.base_qpos, plant.base_dof
        quat = qpos[..., q + 3 : q + 7]
        speed_b = rotate_by_cross(conjugate(quat), qvel[..., v : v + 3]) + parts["base_lin_vel"]
        quat = multiply(quat, from_rotation_vector(parts["base_rot"]))
        qpos[..., q + 3 : q + 7] = quat
        qvel[..., v : v + 3] = rotate_by_cross(quat, speed_b)
        qvel[..., v + 3 : v + 6] += parts["base_ang_vel"]
        if "base_pos" in parts:
            qpos[..., q : q + 3] += parts["base_pos"]
        else:
            qpos[..., q + 2] += move[..., -1]
    return Starts(qpos, qvel)


def _balanced_signs(windows: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Signs (K, W, count) whose columns are orthogonal and sum to zero in every window."""
    size = 1 << int(np.ceil(np.log2(count + 1)))
    table = hadamard(size)[:, 1:].astype(float)
    columns = np.argsort(rng.random((windows, size - 1)), axis=1)[:, :count]
    flips = rng.choice([-1.0, 1.0], size=(windows, count))
    return table[:, columns] * flips


@dataclass(frozen=True, eq=False)
class Stepped:
    """Effect of the length of its steps on W simulated windows; NaN where these diverge."""

    change: np.ndarray
    """(W, N, D) change of the prediction from steps twice as long."""
    left: np.ndarray
    """(W, N, D) residual in the steps that are not longer."""


@dataclass(frozen=True, eq=False)
class Sampled:
    """Effect of noise in the starts of W windows on their residuals."""

    moved: np.ndarray
    """(K, W, M) change of the residual from K perturbed starts."""
    signs: np.ndarray
    """(K, W, C) by which coordinates were moved, in standard deviations."""
    valid: np.ndarray
    """(W,) windows whose simulations stayed finite."""

    @property
    def slopes(self) -> np.ndarray:
        """(W, C, M) change of the residual for a standard deviation of each coordinate."""
        return np.einsum("kwc,kwm->wcm", self.signs, self.moved, optimize=True) / len(self.signs)


def sample(noisy: NoisyWindows, rng: np.random.Generator) -> Sampled:
    """Simulate perturbed starts of the windows."""
    windows, noise = noisy.windows, noisy.start_noise
    signs = _balanced_signs(len(windows), len(noise), rng)
    starts = displaced(noisy.plant, noisy.layout, windows, signs * noise)
    base = noisy.residuals()[0]
    moved = noisy.residuals(starts) - base
    valid = np.isfinite(moved).all(axis=(0, 2, 3)) & np.isfinite(base).all(axis=(1, 2))
    return Sampled(np.nan_to_num(moved).reshape(len(moved), len(windows), -1), signs, valid)


def fit_whitener(
    noisy: NoisyWindows, rng: np.random.Generator, move: np.ndarray | None = None, stepped: Stepped | None = None
) -> Whitener:
    """The whitener of the windows for their model, their sensors' noise and, if given, the simulation's own error.

    Args:
        noisy: windows, model and noise.
        rng: of the perturbed starts' signs.
        move: (W, C) by how much the starts have been displaced from the measured ones, if they have.
        stepped: what steps twice as long change.
    """
    found = sample(noisy, rng)
    mean = found.moved.mean(axis=0)
    away = found.moved - mean
    factor = factors_of(found, noisy.sigma, noisy.rule, stepped)
    white = np.matmul(factor, away.transpose(1, 2, 0)).transpose(2, 0, 1).astype(np.float32)
    offset, slopes = np.zeros_like(mean), found.slopes
    if move is not None:
        offset = np.einsum("wc,wcm->wm", move / noisy.start_noise, slopes)
    slopes = np.matmul(slopes, factor.transpose(0, 2, 1)).astype(np.float32)
    return Whitener(factor, offset, np.matmul(factor, mean[..., None])[..., 0], found.valid, white, slopes)


def null_draws(whitener: Whitener, sigma: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Whitened residuals (K, W, M) of a complete model: noise `sigma` (D,) in the readings and in the starts.

    Each window's perturbed starts come in an order of its own.
    """
    count, windows, size = whitener.moved.shape
    order = np.argsort(rng.random((count, windows)), axis=0)
    starts = np.take_along_axis(whitener.moved, order[..., None], axis=0)
    reading = np.tile(sigma, size // len(sigma)) * rng.standard_normal((count, windows, size))
    return starts + np.matmul(whitener.factor, reading.transpose(1, 2, 0)).transpose(2, 0, 1)


def factors_of(found: Sampled, sigma: np.ndarray, rule: Whitening, stepped: Stepped | None = None) -> np.ndarray:
    """Inverse Cholesky factors (W, M, M) of the covariance of what noise in the starts makes plus that of readings.

    And of what steps of a finite length make of a prediction: `stepped` is what steps of twice the length change. What
    all windows have of it together is a nuisance (`nuisances`); of a share of it that is each window's own, what
    exceeds the noise in a signal counts along it and, by its root mean square, in every reading.
    """
    samples, windows, size = found.moved.shape
    away = found.moved - found.moved.mean(axis=0)
    numeric = np.zeros((windows, size // len(sigma), len(sigma)))
    if stepped is not None:
        numeric = _own_numerical_error(stepped, sigma, rule, away.var(axis=0).reshape(numeric.shape))
    each = np.sqrt((numeric**2).mean(axis=1))
    numeric, each = numeric.reshape(windows, -1), np.tile(each, (1, size // len(sigma)))
    reading = np.tile(sigma**2, size // len(sigma))
    # The slopes have bent to all but these of the samples.
    free = samples - 1 - found.signs.shape[2]
    slopes, out = found.slopes, np.empty((windows, size, size))
    for w in range(windows):
        # Scale first: signals of different units would spoil the factor's condition.
        scale = np.sqrt(reading + away[:, w].var(axis=0))
        x, own = away[:, w] / scale, numeric[w] / scale
        covariance = (x.T @ x) / samples + np.outer(own, own)
        diagonal = (reading + each[w] ** 2) / scale**2
        if free > 0:
            curved = ((x - found.signs[:, w] @ (slopes[w] / scale)) ** 2).sum(axis=0) / free
            diagonal += rule.curved * curved
        covariance[np.diag_indices(size)] += diagonal
        out[w] = dtrtri(np.linalg.cholesky(covariance), lower=1)[0] / scale
    return out


def _own_numerical_error(stepped: Stepped, sigma: np.ndarray, rule: Whitening, started: np.ndarray) -> np.ndarray:
    """A window's own numerical error (W, N, D) as far as it exceeds the noise `sigma` (D,) of a signal.

    None where far more is left of a signal in most windows than that and noise, its own and what the starts' makes of
    it, a variance `started` (W, N, D): the model lacks something, and numerical error would only take weight off the
    windows and signals in which most happens.
    """
    changed, left = np.nan_to_num(stepped.change), np.nan_to_num(stepped.left)
    own = rule.stepped * changed
    power, remaining = ((x**2).mean(axis=1, keepdims=True) for x in (own, left))
    usual = (changed**2).mean(axis=1, keepdims=True) + sigma**2 + started.mean(axis=1, keepdims=True)
    explains = ((remaining <= rule.explained**2 * usual).mean(axis=0) >= 0.5).all()
    beyond = np.maximum(power - sigma**2, 0.0) * explains
    return own * np.sqrt(beyond / np.where(power > 0, power, 1.0))
