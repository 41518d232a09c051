"""Play, tried at many gaps on the few windows that are furthest off.

A gap acts where the torque through it changes sign: there the motor lets go, crosses it and takes the link along again.
What it does grows with no power of its size, so slopes say nothing of it, and the few windows that feel it are too few
for a variance between windows. So a joint of which single windows are further off than noise is tried with a geometric
series of gaps on those windows, and the best of them on all. Its gain is the fall of the fit's robust cost, as of
`diagnosis.limits`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg.lapack import dtrtri
from scipy.stats import chi2

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.eligible import is_chosen
from bumblebee.diagnosis.fit import Fit, cost_of, typical_power
from bumblebee.diagnosis.problem import Problem
from bumblebee.diagnosis.trials import Beside, Trial

KIND = "backlash"
_NEAR = 2.0  # median chi-square above which all windows are off, for other reasons
_ODD = 0.05  # chance of noise to put any window of a joint so far off
_MOST_JOINTS, _WINDOWS = 2, 16
_SMALLEST, _RATIO, _COUNT = 0.2, 1.35, 22  # gaps: the first of the encoder's noise; their ratio; how many
_NONE = 1e-6  # [rad] a gap as good as none
_HARM = 2  # sizes that may only do harm, one after the other
_WORTH, _PART = 30.0, 20.0  # fall of the cost on all windows; on those that were tried
_BETTER, _SEVERAL, _ALONE = 4.0, 3, 0.8  # fall of a window's cost; windows; share of all that one may have
_SHAPE = 0.5  # of the gap: ten times what sensitivities are differences of


def play_trials(
    problem: Problem,
    fit: Fit,
    candidates: Sequence[Candidate],
    weights: np.ndarray,
    hopeless: set[tuple[str, str]],
) -> list[Trial]:
    """The gap that explains most; none where none does. Its joint and those on which none does join the `hopeless`.

    These are not tried again: a gap that is refused now would be refused again.
    """
    clean = fit.clean(problem)
    usual = max(typical_power(clean), 1.0)
    if usual > _NEAR:
        return []
    found = []
    for where, odd in odd_joints(problem, clean):
        own = [c for c in candidates if c.effect == KIND and c.where == where and not is_chosen(c, fit.chosen)]
        if (KIND, where) in hopeless:
            continue
        tried = [t for t in (_best(problem, fit, weights, usual, c, odd) for c in own) if t is not None]
        if not tried:
            hopeless.add((KIND, where))
        found += tried
    best = sorted(found, key=lambda t: t.cost)[:1]
    hopeless.update((KIND, t.candidate.where) for t in best)
    return best


def odd_joints(problem: Problem, clean: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """Joints whose own readings are off in some windows, with these windows, the furthest first; the worst joints."""
    own, freedom = joint_chi_squares(problem, clean)
    usual = max(typical_power(clean), 1.0)
    doubt = chi2.sf(own.max(axis=0) / usual, freedom) * len(own)
    worst = [int(j) for j in np.argsort(doubt)[:_MOST_JOINTS] if doubt[j] < _ODD]
    return [(problem.plant.joints[j], np.sort(np.argsort(-own[:, j])[:_WINDOWS])) for j in worst]


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


def _best(
    problem: Problem, fit: Fit, weights: np.ndarray, usual: float, candidate: Candidate, odd: np.ndarray
) -> Trial | None:
    """The best gap of the series, sought on the windows `odd`, if it explains several and on the whole."""
    some = problem.part(odd)

    def at(gap: float) -> list:
        return [*fit.effects, candidate.at([gap, *candidate.start[1:]])]

    # With the encoder on the joint servos are integrated otherwise, which may gain something by itself.
    none = some.residual([at(_NONE)])[0]

    def gain(gap: float) -> float:
        return float(falls(some, none, some.residual([at(gap)])[0], usual).sum())

    first = _SMALLEST * float(problem.sigma[problem.plant.joints.index(candidate.where)])
    gaps, gains, bad = [], [], 0
    for k in range(_COUNT):
        gaps.append(first * _RATIO**k)
        gains.append(gain(gaps[-1]))
        bad = bad + 1 if gains[-1] < -2 * usual * none.shape[1] else 0
        if bad >= _HARM:
            break
    best = int(np.argmax(gains))
    if gains[best] < _PART:
        return None
    gap, most = gaps[best], gains[best]
    for ratio in (_RATIO**0.5, _RATIO**0.25):
        for factor in (ratio, 1 / ratio):
            new = gain(gap * factor)
            if new > most:
                gap, most = gap * factor, new
                break
    none, after = problem.residual([at(_NONE), at(gap)])
    each = falls(problem, none, after, usual)
    better = each > _BETTER
    if each.sum() < _WORTH or better.sum() < _SEVERAL or each.max() > _ALONE * each.sum():
        return None
    change, beside = fit.residual - after, Beside(problem, fit, weights)
    values = np.array([gap, *candidate.start[1:]])
    own = replace(candidate, step=(_SHAPE * gap, *candidate.step[1:]))
    return Trial(own, values, beside.cost(after), beside.left(change))


def falls(problem: Problem, before: np.ndarray, after: np.ndarray, usual: float) -> np.ndarray:
    """Fall (W,) of the robust cost from a residual (W, M) to another, each with its own nuisances."""
    ones = np.ones(len(before))
    left = [r - np.tensordot(cost_of(problem, r, ones)[1], problem.nuisance, axes=1) for r in (before, after)]
    old, new = (np.log1p((x**2).mean(axis=1) / usual) for x in left)
    return 2.0 * usual * before.shape[1] * (old - new)
