"""Does anything with structure remain? A test of the held-out residual against what it must not depend on.

The whitened residual of a window is noise where the model is complete. For every joint its sum is correlated with
simple functions of that joint's position, velocity, torque and time. Flipping the sign of whole windows gives the
distribution of the largest correlation where there is no structure.
"""

from typing import Any

import numpy as np

from bumblebee.diagnosis.fit import Fit
from bumblebee.diagnosis.problem import Problem

_FLIPS = 500
_LEVEL = 0.01
# Structure smaller than this correlation is left to the noise: it would not be worth a term.
_LEAST = 0.1


def unexplained(
    problem: Problem, fit: Fit, joints: tuple[str, ...], torque: np.ndarray, seed: int = 0
) -> dict[str, Any]:
    """The contract's `unexplained` block; `torque` (W, J) is the servo's torque at each window's start."""
    left = fit.residual - np.tensordot(fit.nuisance, problem.nuisance, axes=1)
    left = left.reshape(*problem.windows.measured.shape)
    part = problem.layout.slices["joint_vel"]
    # The sum over a window's ticks of the whitened velocity residual: one number a window and joint.
    response = left[..., part].sum(axis=1)
    response = response + left[..., problem.layout.slices["joint_pos"]].sum(axis=1)
    features = _features(problem, torque)
    names = list(features)
    design = np.stack([features[n] for n in names])
    design = design - design.mean(axis=1, keepdims=True)
    design /= np.maximum(design.std(axis=1, keepdims=True), 1e-12)
    names, design = [*names, "constant"], np.concatenate((design, np.ones((1, *design.shape[1:]))))
    spread = np.maximum(np.abs(response).std(axis=0) + np.abs(response).mean(axis=0), 1e-12)
    ranked = np.clip(response / spread, -4, 4)

    def correlations(values: np.ndarray) -> np.ndarray:
        scale = np.sqrt((values**2).mean(axis=0)) * np.sqrt(len(values))
        return np.abs(np.einsum("fwj,wj->fj", design, values)) / np.maximum(scale, 1e-12)

    seen = correlations(ranked)
    rng = np.random.default_rng(seed)
    flips = rng.choice([-1.0, 1.0], size=(_FLIPS, len(ranked), 1))
    largest = np.array([correlations(ranked * flip).max() for flip in flips])
    p = float((1 + (largest >= seen.max()).sum()) / (1 + _FLIPS))
    bar = np.quantile(largest, 1 - _LEVEL)
    size = seen / np.sqrt(len(ranked))
    found = [(size[f, j], joints[j], names[f]) for f, j in zip(*np.where((seen > bar) & (size > _LEAST)), strict=True)]
    found.sort(reverse=True)
    significant = p < _LEVEL and bool(found)
    where = list(dict.fromkeys(joint for _, joint, _ in found)) if significant else []
    depends = list(dict.fromkeys(name for _, _, name in found)) if significant else []
    return {
        "significant": significant,
        "p": p,
        "where": where,
        "depends_on": depends,
        "description": _describe(found) if significant else "",
    }


def _features(problem: Problem, torque: np.ndarray) -> dict[str, np.ndarray]:
    """Name -> (W, J): what a missing term could be a function of."""
    position = problem.windows.qpos[:, problem.plant.qpos]
    velocity = problem.windows.measured[..., problem.layout.slices["joint_vel"]].mean(axis=1)
    time = np.array(problem.windows.start, dtype=float)[:, None] * np.ones(velocity.shape[1])
    return {
        "position": position,
        "velocity": velocity,
        "sign of velocity": np.sign(velocity),
        "velocity squared": velocity * np.abs(velocity),
        "torque": torque,
        "time": time,
        "position squared": (position - position.mean(axis=0)) ** 2,
        "torque times velocity sign": np.abs(torque) * np.sign(velocity),
    }


def _describe(found: list[tuple[float, str, str]]) -> str:
    strongest = ", ".join(f"{joint} with {name} (correlation {size:.2f})" for size, joint, name in found[:3])
    return f"what is left of the held-out residual goes with: {strongest}"
