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

from bumblebee.diagnosis.candidates import Candidate, is_chosen
from bumblebee.diagnosis.estimation import Fit, LeftOver, typical_power
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.proposals.joint_misfit import falls, odd_joints
from bumblebee.diagnosis.selection.trial import Trial

KIND = "backlash"
_NEAR = 2.0  # median chi-square above which all windows are off, for other reasons
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
    change, beside = fit.residual - after, LeftOver(problem, fit, weights)
    values = np.array([gap, *candidate.start[1:]])
    own = replace(candidate, step=(_SHAPE * gap, *candidate.step[1:]))
    return Trial(own, values, beside.cost(after), beside.left(change))
