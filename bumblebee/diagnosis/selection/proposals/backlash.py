"""Backlash, tried at many gaps on the few windows that are furthest off.

Backlash acts where the torque through it changes sign: there the motor lets go, crosses the gap and takes the link
along again. What it does grows with no power of its size, so slopes say nothing of it, and the few windows that feel it
are too few for a variance between windows. So a joint of which single windows are further off than noise is tried with
a geometric series of gaps on those windows, and the best of them on all. Its gain is the fall of the fit's robust cost,
as of `proposals.saturation`.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, is_chosen
from bumblebee.diagnosis.estimation import Fit, LeftOver, typical_power
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.changes import Asking, Vain
from bumblebee.diagnosis.selection.profile import profile, stepped
from bumblebee.diagnosis.selection.proposals.joint_misfit import falls, odd_joints
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.trial import Trial
from bumblebee.diagnosis.thresholds.proposals import Backlash

KIND = "backlash"


def backlash_trials(run: SearchState) -> Asking[list[Trial]]:
    """The backlash that explains most; none where none does.

    Its joint and those on which none does are then `hopeless`, (effect, joint). These are not tried again:
    a backlash that is refused now would be refused again.
    """
    problem, fit = run.problem, run.fit
    clean = fit.clean(problem)
    usual = max(typical_power(clean), 1.0)
    if usual > problem.thresholds.selection.proposals.backlash.most_usual_power:
        return []
    found = []
    for where, odd in odd_joints(problem, clean):
        own = [c for c in run.candidates if c.effect == KIND and c.where == where and not is_chosen(c, fit.chosen)]
        if (KIND, where) in run.hopeless:
            continue
        tried = [t for t in (_best(problem, fit, run.weights, usual, c, odd) for c in own) if t is not None]
        if not tried:
            yield Vain(KIND, where)
        found += tried
    best = sorted(found, key=lambda t: t.cost)[:1]
    for t in best:
        yield Vain(KIND, t.candidate.where)
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
    harm = -2.0 * usual * none.shape[1] * rule.harm

    def ends(gains: Sequence[float]) -> bool:
        last = gains[-rule.harmful_sizes :]
        return len(last) == rule.harmful_sizes and max(last) < harm

    series = profile(lambda gaps: [gain(g) for g in gaps], [first * rule.ratio**k for k in range(rule.count)], ends)
    if series.gain < rule.least_gain_tried:
        return None
    gap, _ = stepped(gain, series.size, series.gain, (rule.ratio**0.5, rule.ratio**0.25))
    none, after = problem.residual([at(rule.none), at(gap)])
    if not _is_enough(falls(problem, none, after, usual), rule):
        return None
    change, left_over = fit.residual - after, LeftOver(problem, fit, weights)
    values = np.array([gap, *candidate.start[1:]])
    own = replace(candidate, step=(rule.step * gap, *candidate.step[1:]))
    return Trial(own, values, left_over.cost(after), left_over.left(change))


def _is_enough(each: np.ndarray, rule: Backlash) -> bool:
    """Whether the falls (W,) of the windows' costs are enough together, and not those of one or two windows."""
    few = (each > rule.window_gain).sum() < rule.better_windows
    return not (each.sum() < rule.least_gain or few or each.max() > rule.largest_share * each.sum())
