"""Backlash, tried at many gaps on the few windows that are furthest off.

Backlash acts where the torque through it changes sign: there the motor lets go, crosses the gap and takes the link
along again. What it does grows with no power of its size, so slopes say nothing of it, and the few windows that feel it
are too few for a variance between windows. So a joint of which single windows are further off than noise is tried with
a geometric series of gaps on those windows, and the best of them on all. Its gain is the fall of the fit's robust cost,
as of `proposals.saturation`.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, is_chosen
from bumblebee.diagnosis.estimation import Fit, LeftOver, typical_power
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.proposals.joint_misfit import falls, odd_joints
from bumblebee.diagnosis.selection.trial import Trial
from bumblebee.diagnosis.thresholds.proposals import Backlash

KIND = "backlash"


def backlash_trials(
    problem: Problem,
    fit: Fit,
    candidates: Sequence[Candidate],
    weights: np.ndarray,
    hopeless: set[tuple[str, str]],
) -> list[Trial]:
    """The backlash that explains most; none where none does.

    Its joint and those on which none does join the `hopeless`. These are not tried again:
    a backlash that is refused now would be refused again.
    """
    clean = fit.clean(problem)
    usual = max(typical_power(clean), 1.0)
    if usual > problem.thresholds.selection.proposals.backlash.most_usual_power:
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
    rule = problem.thresholds.selection.proposals.backlash
    some = problem.part(odd)

    def at(gap: float) -> list:
        return [*fit.effects, candidate.at([gap, *candidate.start[1:]])]

    # With the encoder on the joint servos are integrated otherwise, which may gain something by itself.
    none = some.residual([at(rule.none)])[0]

    def gain(gap: float) -> float:
        return float(falls(some, none, some.residual([at(gap)])[0], usual).sum())

    first = rule.first * float(problem.sigma[problem.plant.joints.index(candidate.where)])
    gap, most = _best_of_series(gain, first, -2.0 * usual * none.shape[1] * rule.harm, rule)
    if most < rule.least_gain_tried:
        return None
    gap = _refined(gain, gap, most, rule.ratio)
    none, after = problem.residual([at(rule.none), at(gap)])
    if not _is_enough(falls(problem, none, after, usual), rule):
        return None
    change, left_over = fit.residual - after, LeftOver(problem, fit, weights)
    values = np.array([gap, *candidate.start[1:]])
    own = replace(candidate, step=(rule.step * gap, *candidate.step[1:]))
    return Trial(own, values, left_over.cost(after), left_over.left(change))


def _best_of_series(gain: Callable[[float], float], first: float, harm: float, rule: Backlash) -> tuple[float, float]:
    """The gap [rad] of the series from `first` on that gains most, and its gain; gains below `harm` may end it."""
    gaps, gains, bad = [], [], 0
    for k in range(rule.count):
        gaps.append(first * rule.ratio**k)
        gains.append(gain(gaps[-1]))
        bad = bad + 1 if gains[-1] < harm else 0
        if bad >= rule.harmful_sizes:
            break
    best = int(np.argmax(gains))
    return gaps[best], gains[best]


def _refined(gain: Callable[[float], float], gap: float, most: float, ratio: float) -> float:
    """The gap [rad] after two finer steps to either side of one that gains `most`."""
    for finer in (ratio**0.5, ratio**0.25):
        for factor in (finer, 1 / finer):
            new = gain(gap * factor)
            if new > most:
                gap, most = gap * factor, new
                break
    return gap


def _is_enough(each: np.ndarray, rule: Backlash) -> bool:
    """Whether the falls (W,) of the windows' costs are enough together, and not those of one or two windows."""
    few = (each > rule.window_gain).sum() < rule.better_windows
    return not (each.sum() < rule.least_gain or few or each.max() > rule.largest_share * each.sum())
