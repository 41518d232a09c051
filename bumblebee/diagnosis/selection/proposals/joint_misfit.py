"""Which joints the fit explains worst, window by window."""

import numpy as np
from scipy.linalg.lapack import dtrtri
from scipy.stats import chi2

from bumblebee.diagnosis.estimation import cost_of, typical_power
from bumblebee.diagnosis.residuals import Problem


def odd_joints(problem: Problem, clean: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """Joints whose own readings are off in some windows, with these windows, the furthest first; the worst joints."""
    rule = problem.thresholds.selection.proposals.joint_misfit
    own, freedom = joint_chi_squares(problem, clean)
    usual = max(typical_power(clean), 1.0)
    doubt = chi2.sf(own.max(axis=0) / usual, freedom) * len(own)
    worst = [int(j) for j in np.argsort(doubt)[: rule.joints] if doubt[j] < rule.chance]
    return [(problem.plant.joints[j], np.sort(np.argsort(-own[:, j])[: rule.windows])) for j in worst]


def joint_chi_squares(problem: Problem, clean: np.ndarray) -> tuple[np.ndarray, int]:
    """Chi-squares (W, J) of each joint's own readings in a whitened residual (W, M), and their degrees of freedom."""
    place, speed = (np.arange(problem.layout.size)[problem.layout.slices[n]] for n in ("joint_pos", "joint_vel"))
    ticks = np.arange(clean.shape[1] // problem.layout.size) * problem.layout.size
    rows = np.concatenate((ticks[:, None] + place, ticks[:, None] + speed)).T  # (J, 2 N)
    out = np.empty((len(clean), len(place)))
    for w, whitened in enumerate(clean):
        factor = dtrtri(problem.whitener.factor[w].astype(float), lower=1)[0]
        own = factor[rows]  # (J, 2 N, M)
        raw = own @ whitened
        spread = np.matmul(own, own.transpose(0, 2, 1))
        out[w] = np.einsum("ji,ji->j", raw, np.linalg.solve(spread, raw[..., None])[..., 0])
    return out, 2 * len(ticks)


def falls(problem: Problem, before: np.ndarray, after: np.ndarray, usual: float) -> np.ndarray:
    """Fall (W,) of the robust cost from a residual (W, M) to another, each with its own nuisances."""
    ones = np.ones(len(before))
    left = [r - np.tensordot(cost_of(problem, r, ones)[1], problem.nuisance, axes=1) for r in (before, after)]
    old, new = (np.log1p((x**2).mean(axis=1) / usual) for x in left)
    return 2.0 * usual * before.shape[1] * (old - new)
