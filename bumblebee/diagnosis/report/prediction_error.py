"""The contract's `error` block: how far a model is from the measurements, by horizon, joint and base.

Windows restart from measured states. The floor is what sensor noise alone leaves: the same windows of the best model,
started from perturbed states and compared with readings as noisy as the sensors'.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.stats import t as student

from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.residuals import NoisyWindows, Whitener, fit_whitener
from bumblebee.diagnosis.simulation import (
    KINDS,
    Layout,
    Plant,
    Variation,
    Windows,
    choose_starts,
    cut,
    members,
    residuals,
    select,
)
from bumblebee.diagnosis.thresholds.report import PredictionError
from bumblebee.effects.units import joint_unit

HORIZONS = ("0.02", "0.2", "1.0")


@dataclass(frozen=True, eq=False)
class HorizonWindows:
    """Windows for every horizon that the data reach."""

    plant: Plant
    layout: Layout
    windows: dict[str, Windows]
    """By horizon; only their last tick is compared."""
    rule: PredictionError = field(default_factory=PredictionError)


Whiteners = dict[str, tuple[np.ndarray, Whitener]]
"""For every horizon some of its windows (indices) and their whitener."""

Residuals = dict[str, np.ndarray]
"""For every horizon what is measured less what is simulated, see `window_residuals`."""


def horizon_windows(
    session: Session, ids: Sequence[int], budget: int, rule: PredictionError | None = None
) -> HorizonWindows:
    """Windows of the rollouts `ids`, `budget` at most for every horizon."""
    found = {}
    for name in HORIZONS:
        starts = choose_starts(session.rollouts, ids, float(name), budget, session.plant.thresholds.windows)
        if starts:
            found[name] = cut(session.plant, session.layout, session.rollouts, starts, outputs=1)
    return HorizonWindows(session.plant, session.layout, found, rule or PredictionError())


def horizon_whiteners(
    cuts: HorizonWindows, variation: Variation, sigma: np.ndarray, step: float, seed: int
) -> Whiteners:
    """The whiteners of a model; the longer the horizon, the fewer windows, for they cost more."""
    rng, most = np.random.default_rng(seed), dict(cuts.rule.whitened)
    found = {}
    for name, part in cuts.windows.items():
        count = min(len(part), most[name])
        keep = np.unique(np.linspace(0, len(part) - 1, count).round().astype(int))
        noisy = NoisyWindows(cuts.plant, cuts.layout, select(part, keep), variation, sigma, step)
        found[name] = keep, fit_whitener(noisy, rng)
    return found


def window_residuals(cuts: HorizonWindows, variation: Variation, step: float) -> Residuals:
    """Horizon -> (W, 1, D) measured - simulated at the end of every window; NaN where a simulation diverged."""
    return {name: residuals(cuts.plant, cuts.layout, part, [variation], step)[0] for name, part in cuts.windows.items()}


def error_block(
    cuts: HorizonWindows, whiteners: Whiteners, variation: Variation, step: float, seed: int = 0
) -> dict[str, Any]:
    """`before` or `after`: horizon -> measure -> value, ci95 and, for joints, per_joint."""
    return block_of(cuts, whiteners, window_residuals(cuts, variation, step), seed)


def block_of(cuts: HorizonWindows, whiteners: Whiteners, ends: Residuals, seed: int = 0) -> dict[str, Any]:
    """Error block of residuals that are there already."""
    rng = np.random.default_rng(seed)
    block = {}
    for name, part in cuts.windows.items():
        keep, whitener = whiteners[name]
        raw = ends[name]
        good = np.all(np.isfinite(raw), axis=(1, 2))
        chi = (whitener(raw[keep]) ** 2).mean(axis=1)[good[keep]]
        chi_groups = part.rollout[keep][good[keep]]
        block[name] = _measures(cuts, (raw[good, 0], part.rollout[good]), (chi, chi_groups), rng)
        block[name]["windows"] = {"value": int(good.sum()), "diverged": int((~good).sum())}
    return block


def floor_block(cuts: HorizonWindows, whiteners: Whiteners, sigma: np.ndarray, seed: int = 0) -> dict[str, Any]:
    """Error block that sensor noise alone would leave, from the starts that the whiteners simulated."""
    rng = np.random.default_rng(seed)
    block = {}
    for name, every in cuts.windows.items():
        keep, whitener = whiteners[name]
        part = select(every, keep)
        moved = np.linalg.solve(whitener.factor[None], (whitener.moved + whitener.curvature)[..., None])[..., 0]
        error = moved.reshape(len(moved), *part.measured.shape)
        error = error + sigma * rng.standard_normal(error.shape)
        good = np.broadcast_to(whitener.valid, error.shape[:2])
        chi = (whitener(error, centre=False) ** 2).mean(axis=2)[good]
        groups = np.broadcast_to(part.rollout, good.shape)[good]
        block[name] = _measures(cuts, (error[good][:, 0], groups), (chi, groups), rng)
    return block


def _measures(
    cuts: HorizonWindows,
    errors: tuple[np.ndarray, np.ndarray],
    chi: tuple[np.ndarray, np.ndarray],
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Measures of errors (W, D) and of chi-squares (some of W), each with its rollouts, and intervals over these."""
    (error, groups), draws, out = errors, cuts.rule.resamples, {}
    for name in ("joint_pos", "joint_vel"):
        squares = error[:, cuts.layout.slices[name]] ** 2
        whole = with_interval(squares.mean(axis=1), groups, rng, draws)
        whole |= _by_kind(cuts, name, squares, groups)
        joints = enumerate(cuts.plant.joints)
        whole["per_joint"] = {joint: with_interval(squares[:, j], groups, rng, draws) for j, joint in joints}
        out[f"{name}_rmse"] = whole
    for name in ("base_pos", "base_rot"):
        if name in cuts.layout.slices:
            squares = (error[:, cuts.layout.slices[name]] ** 2).sum(axis=1)
            out[f"{name}_rmse"] = with_interval(squares, groups, rng, draws)
    out["chi2"] = with_interval(*chi, rng, draws, root=False)
    return out


def _by_kind(cuts: HorizonWindows, name: str, squares: np.ndarray, groups: np.ndarray) -> dict[str, Any]:
    """Root mean squares of squares (W, J) with their unit; hinges and slides apart where the robot has both."""
    hinge, kinds = {"joint_pos": "rad", "joint_vel": "rad/s"}[name], members(cuts.plant)
    units = {kind: joint_unit(hinge, KINDS[kind]) for kind in kinds}
    if len(kinds) == 1:
        return {"unit": next(iter(units.values()))}
    rng = np.random.default_rng(0)
    apart = {
        kind: with_interval(squares[:, columns].mean(axis=1), groups, rng, cuts.rule.resamples) | {"unit": units[kind]}
        for kind, columns in kinds.items()
    }
    return {"unit": f"{units['hinge']}, 1 {units['slide']} as 1 {units['hinge']}", "by_kind": apart}


def with_interval(
    values: np.ndarray, groups: np.ndarray, rng: np.random.Generator, resamples: int, root: bool = True
) -> dict[str, Any]:
    """Mean (or its root) of per-window values and its 95 % bootstrap interval over rollouts; None with one rollout."""
    _, index = np.unique(groups, return_inverse=True)
    sums, counts = np.bincount(index, values), np.bincount(index).astype(float)
    if not len(values):
        return {"value": None, "ci95": None}
    mean = float(sums.sum() / counts.sum())
    finish = np.sqrt if root else np.asarray
    if len(sums) < 2:
        return {"value": float(finish(mean)), "ci95": None}
    draws = rng.integers(0, len(sums), size=(resamples, len(sums)))
    means = sums[draws].sum(axis=1) / counts[draws].sum(axis=1)
    value = float(finish(mean))
    low, high = widened(value, np.quantile(finish(means), [0.025, 0.975]), len(sums))
    return {"value": value, "ci95": [max(low, 0.0), high]}


def widened(value: float, ends: np.ndarray, rollouts: int) -> tuple[float, float]:
    """Ends of a bootstrap interval over few rollouts, whose percentiles are too narrow.

    Widened as Student's t is wider than the normal distribution.
    """
    few = student.ppf(0.975, rollouts - 1) / 1.96 * np.sqrt(rollouts / (rollouts - 1))
    low, high = value + few * (ends - value)
    return float(low), float(high)
