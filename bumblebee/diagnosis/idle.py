"""Effects that take nothing off the error of the windows that judge: none of them is reported.

They were accepted beside others and for the windows that were fitted; in the result the judging windows are no nearer
with them. A robot that is still far from its model is left alone: there a few windows make up the mean square (two
joints' damping on the SO-101 arm, needless by it, made 13.8 mrad after 1 s of 8.6).

Limits are asked otherwise, for of the judging windows perhaps none feels them, and no slope leads back from one that
nothing reaches: each must pay as when it was accepted, against a fit without it. One that stood for a part of a strange
friction explains nothing once that has its form.
"""

import numpy as np

from bumblebee.diagnosis.fit import Fit, typical_power
from bumblebee.diagnosis.holdout import Holdout
from bumblebee.diagnosis.limits import KINDS as LIMITS
from bumblebee.diagnosis.limits import pays_where_felt
from bumblebee.diagnosis.problem import Problem
from bumblebee.diagnosis.refits import refitted, without_one

_NEAR = 4.0  # median chi-square of the judging windows up to which their mean square tells

_Z, _LEAST = 2.0, 0.01  # as of acceptance


def without_idle(problem: Problem, holdout: Holdout, fit: Fit) -> Fit:
    """The fit less such effects, the worst first, the others refitted without it; no worse after 1 s."""
    if holdout.problem is None or typical_power(holdout.left([fit])[0]) > _NEAR:
        return fit
    while fit.chosen:
        growth = _growth(holdout.problem, fit)
        growth[[c.effect in LIMITS for c in fit.chosen]] = np.inf
        worst = int(np.argmin(growth))
        if growth[worst] > 0:
            break
        chosen, values = without_one(fit.chosen, fit.values, fit.chosen[worst])
        less = refitted(problem, chosen, values, fit)
        if holdout.worse_later(fit, less):
            break
        fit = less
    return fit


def without_spent(problem: Problem, holdout: Holdout, fit: Fit) -> Fit:
    """The fit less limits that pay no more beside the other effects, refitted without each."""
    for c in [c for c in fit.chosen if c.effect in LIMITS]:
        if len(fit.chosen) < 2:
            break
        less = refitted(problem, *without_one(fit.chosen, fit.values, c))
        judged = holdout.problem is not None and holdout.gains(less, fit, _Z, _LEAST)
        if not judged and not pays_where_felt(problem, holdout, less, fit):
            fit = less
    return fit


def _growth(judge: Problem, fit: Fit) -> np.ndarray:
    """(F,) by how much the mean square of the judging windows grows without each effect, the others as they are."""
    effects = fit.effects
    sets = [effects, *([e for k, e in enumerate(effects) if k != i] for i in range(len(effects)))]
    left = judge.residual(sets) - np.tensordot(fit.nuisance, judge.nuisance, axes=1)
    power = (left**2).mean(axis=(1, 2))
    return power[1:] - power[0]
