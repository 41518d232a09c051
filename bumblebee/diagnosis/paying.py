"""Whether each effect still pays once all are fitted: what was a step of the search may be nothing of the result.

An effect is accepted beside those that were found before it. What came later may do its work; the loss of such an
effect is felt in the windows that it was fitted to, which it has bent to, and not in those that judge.
"""

import numpy as np

from bumblebee.diagnosis.acceptance import Refit
from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.fit import Fit, cost_of, typical_power
from bumblebee.diagnosis.holdout import Holdout
from bumblebee.diagnosis.limits import KINDS as LIMITS
from bumblebee.diagnosis.limits import pays_where_rare
from bumblebee.diagnosis.problem import Problem, window_weights

_SMALL = 0.05  # share of what all effects gain, above which an effect need not be asked
_Z, _LEAST = 2.0, 0.01  # as of acceptance
_FEW = 4  # effects; of more, each may be a small share of the whole, and they were accepted together
_FAR = 4.0  # median chi-square


def still_paying(fit: Fit, refit: Refit, holdout: Holdout, problem: Problem | None = None) -> Fit:
    """The fit less effects that do not pay on the judging windows, the others refitted without them, the least first.

    Limits are left alone: few windows feel them, of the judging ones perhaps none. Of other effects that these do not
    feel the fitted windows of `problem`, if given, decide. More than four effects are left alone, too, and any where
    the model is still far from the data: what it lacks there spoils the comparison.
    """
    kept: set[Candidate] = set()
    if len(fit.chosen) > _FEW or (holdout.problem is not None and typical_power(holdout.left([fit])[0]) > _FAR):
        return fit
    while holdout.problem is not None and fit.chosen:
        share = shares(holdout, fit)
        asked = [i for i, c in enumerate(fit.chosen) if share[i] < _SMALL and c.effect not in LIMITS and c not in kept]
        if not asked:
            break
        least = min(asked, key=lambda i: share[i])
        keep = [i for i in range(len(fit.chosen)) if i != least]
        values = [fit.values[fit.slices[i]] for i in keep]
        less = refit([fit.chosen[i] for i in keep], np.concatenate(values) if values else np.empty(0))
        rare = problem is not None and pays_where_rare(problem, holdout, less, fit)
        if rare or holdout.gains(less, fit, _Z, _LEAST):
            kept.add(fit.chosen[least])
        else:
            fit = less
    return fit


def shares(holdout: Holdout, fit: Fit) -> np.ndarray:
    """(F,) of what all effects gain on the judging windows, what is lost without each, the others as they are."""
    problem = holdout.problem
    assert problem is not None
    sets = [fit.effects, *([e for k, e in enumerate(fit.effects) if k != i] for i in range(len(fit.chosen))), []]
    raw = problem.residual(sets)
    left = raw - np.tensordot(fit.nuisance, problem.nuisance, axes=1)
    weights = window_weights(left[0])
    left[-1] = raw[-1] - np.tensordot(cost_of(problem, raw[-1], weights)[1], problem.nuisance, axes=1)
    power = (weights[:, None] * left**2).sum(axis=(1, 2))
    return (power[1:-1] - power[0]) / max(power[-1] - power[0], 1e-12)
