"""Starts that the readings after them agree with.

A measured start of a robot in contact has its feet a millimetre above the floor or inside it. What the simulation does
from there is not what it does from the true start, and neither are its sensitivities: masses would come out too small.
Here each start is moved, within the noise, to where the readings of the next few ticks say that it was: one step
of the iterated Kalman filter. The residual is taken back to the measured start to first order (`Whitener.offset`), so
that nothing is gained or lost but the point around which everything is linear, and that is nearly the true one.
"""

from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.residuals.whitening import NoisyWindows, displaced, factors_of, sample
from bumblebee.diagnosis.simulation import Layout, Plant, Windows
from bumblebee.diagnosis.thresholds.residuals import InitialState


def start_moves(noisy: NoisyWindows, rng: np.random.Generator, rule: InitialState) -> np.ndarray:
    """Displacements (W, C) of measured starts, coordinates as `start_noise` has them; 0 where a simulation diverges."""
    short = replace(noisy, windows=_first_ticks(noisy.windows, rule.outputs))
    found = sample(short, rng)
    raw = short.residuals()[0].reshape(len(short.windows), -1)
    factor = factors_of(found, noisy.sigma, noisy.rule)
    white = np.matmul(factor, np.nan_to_num(raw)[..., None])[..., 0]
    slopes = np.matmul(found.slopes, factor.transpose(0, 2, 1))
    move = -np.einsum("wcm,wm->wc", slopes, white)
    good = found.valid & np.isfinite(raw).all(axis=1)
    return np.clip(np.where(good[:, None], move, 0.0), -rule.most, rule.most) * noisy.start_noise


def restarted(plant: Plant, layout: Layout, windows: Windows, move: np.ndarray) -> Windows:
    """The windows with their starts moved by `move` (W, C)."""
    starts = displaced(plant, layout, windows, move[None])
    return replace(windows, qpos=starts.qpos[0], qvel=starts.qvel[0])


def _first_ticks(windows: Windows, count: int) -> Windows:
    """The windows cut off after `count` compared ticks."""
    count = min(count, windows.out_time.shape[1])
    return replace(
        windows,
        out_time=windows.out_time[:, :count],
        measured=windows.measured[:, :count],
        quat=None if windows.quat is None else windows.quat[:, :count],
        span=float(windows.out_time[:, count - 1].max()),
    )
