"""The contract's `error` block: how far a model is from the measurements, by horizon, joint and base.

Windows restart from measured states. The floor is what sensor noise alone leaves: the same windows of the best model,
started from perturbed states and compared with readings as noisy as the sensors'.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from bumblebee.diagnosis.plant import Plant
from bumblebee.diagnosis.signals import Layout
from bumblebee.diagnosis.simulate import residuals
from bumblebee.diagnosis.variation import Variation
from bumblebee.diagnosis.whiten import fit_whitener, perturbed_starts
from bumblebee.diagnosis.windows import Windows, choose_starts, cut
from bumblebee.measured.rollout import Rollout

HORIZONS = ("0.02", "0.2", "1.0")
_RESAMPLES = 400


def horizon_windows(
    plant: Plant, layout: Layout, rollouts: Sequence[Rollout], ids: Sequence[int], budget: int
) -> dict[str, Windows]:
    """Windows for every horizon that the data reach; only their last tick is compared."""
    found = {}
    for name in HORIZONS:
        starts = choose_starts(rollouts, ids, float(name), budget)
        if starts:
            found[name] = cut(plant, layout, rollouts, starts, outputs=1)
    return found


def error_block(
    plant: Plant,
    layout: Layout,
    windows: dict[str, Windows],
    variation: Variation,
    sigma: np.ndarray,
    steps: tuple[float, float],
    seed: int = 0,
    floor: bool = False,
) -> dict[str, Any]:
    """One of before, after, floor: horizon -> measure -> value, ci95 and, for joints, per_joint."""
    rng = np.random.default_rng(seed)
    block = {}
    for name, part in windows.items():
        whitener = fit_whitener(plant, layout, part, variation, sigma, steps[1], rng)
        if floor:
            starts = perturbed_starts(plant, layout, part, sigma, rng)
            centre = residuals(plant, layout, part, [variation], steps[1])[0]
            error = (residuals(plant, layout, part, [variation], steps[1], starts) - centre)[:8]
            error = error + sigma * rng.standard_normal(error.shape)
            error, chi = error.reshape(-1, layout.size), whitener(error).reshape(-1, error.shape[-1])
            groups = np.tile(part.rollout, 8)
        else:
            raw = residuals(plant, layout, part, [variation], steps[0])[0]
            error, chi, groups = raw[:, 0], whitener(raw), part.rollout
        good = np.isfinite(error).all(axis=1)
        block[name] = _measures(plant, layout, error[good], chi[good], groups[good], rng)
        block[name]["windows"] = {"value": int(good.sum()), "diverged": int((~good).sum())}
    return block


def _measures(
    plant: Plant, layout: Layout, error: np.ndarray, chi: np.ndarray, groups: np.ndarray, rng: np.random.Generator
) -> dict[str, Any]:
    """Measures of errors (W, D) and whitened errors (W, D), with intervals over rollouts."""
    out = {}
    for name in ("joint_pos", "joint_vel"):
        squares = error[:, layout.slices[name]] ** 2
        whole = _with_interval(squares.mean(axis=1), groups, rng)
        whole["per_joint"] = {joint: _with_interval(squares[:, j], groups, rng) for j, joint in enumerate(plant.joints)}
        out[f"{name}_rmse"] = whole
    for name in ("base_pos", "base_rot"):
        if name in layout.slices:
            out[f"{name}_rmse"] = _with_interval((error[:, layout.slices[name]] ** 2).sum(axis=1), groups, rng)
    out["chi2"] = _with_interval((chi**2).mean(axis=1), groups, rng, root=False)
    return out


def _with_interval(
    values: np.ndarray, groups: np.ndarray, rng: np.random.Generator, root: bool = True
) -> dict[str, Any]:
    """Mean (or its root) of per-window values and its 95 % bootstrap interval over rollouts; None with one rollout."""
    names, index = np.unique(groups, return_inverse=True)
    sums, counts = np.bincount(index, values), np.bincount(index).astype(float)
    if not len(values):
        return {"value": None, "ci95": None}
    mean = float(sums.sum() / counts.sum())
    finish = np.sqrt if root else np.asarray
    if len(names) < 2:
        return {"value": float(finish(mean)), "ci95": None}
    draws = rng.integers(0, len(names), size=(_RESAMPLES, len(names)))
    means = sums[draws].sum(axis=1) / counts[draws].sum(axis=1)
    low, high = np.quantile(finish(means), [0.025, 0.975])
    return {"value": float(finish(mean)), "ci95": [float(low), float(high)]}
