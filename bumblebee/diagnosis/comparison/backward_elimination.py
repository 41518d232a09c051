"""When an effect is kept: the bound on its z, its Wald test in the joint fit, what else could gain as much, pruning.

Effects that take nothing off the error of the windows that judge: none of them is reported.

They were accepted beside others and for the windows that were fitted; in the result the judging windows are no nearer
with them. A robot that is still far from its model is left alone: there a few windows make up the mean square (two
joints' damping on the SO-101 arm, needless by it, made 13.8 mrad after 1 s of 8.6).

Limits are asked otherwise, for of the judging windows perhaps none feels them, and no slope leads back from one that
nothing reaches: each must pay as when it was accepted, against a fit without it. One that stood for a part of a strange
friction explains nothing once that has its form.

Whether each effect still pays once all are fitted: what was a step of the search may be nothing of the result.

An effect is accepted beside those that were found before it. What came later may do its work; the loss of such an
effect is felt in the windows that it was fitted to, which it has bent to, and not in those that judge.
"""

from collections.abc import Callable, Sequence

import numpy as np

from bumblebee.diagnosis.candidates import SATURATIONS, USUAL_OF_BODIES, Candidate, Formula
from bumblebee.diagnosis.comparison.holdout import Holdout
from bumblebee.diagnosis.comparison.paired_tests import pays_where_felt, pays_where_rare
from bumblebee.diagnosis.comparison.submodel import refitted, without_one, without_some
from bumblebee.diagnosis.comparison.wald import costs_more_than, wald
from bumblebee.diagnosis.estimation import (
    Fit,
    beyond_numerics,
    cost_of,
    gauss_newton,
    standard_covariance,
    typical_power,
)
from bumblebee.diagnosis.residuals import Problem, window_weights

# Where the model restarts a late encoder's joint follows from the mean of two noisy readings: that alone gains a
# little of the chi-square of the joint's own signals, on all joints at once more.
_NOISY, _NOISY_GAIN, _NOISY_ALL = ("encoder_delay",), 0.1, 0.05
Refit = Callable[[Sequence[Candidate], np.ndarray], Fit]
"""Fits chosen candidates from their values (P,)."""
_SURE, _SURE_OF_BODY = 4.0, 5.0  # standard errors
_TRIFLE = 0.02  # share of a change that matters
SURE = 4.0  # z below which an effect beside a new one is needless
_NEAR = 4.0  # median chi-square of the judging windows up to which their mean square tells
_IDLE_Z, _IDLE_LEAST = 2.0, 0.01  # as of acceptance
_SMALL = 0.05  # share of what all effects gain, above which an effect need not be asked
_Z, _LEAST = 2.0, 0.01  # as of acceptance
_FEW = 4  # effects; of more, each may be a small share of the whole, and they were accepted together
_FAR = 4.0  # median chi-square


def is_physical(problem: Problem, fit: Fit, new: Fit, candidate: Candidate, weights: np.ndarray) -> bool:
    """Whether neither another integrator nor the readings' noise would do what the new fit gains.

    `fit` is the one without the candidate; `weights` (W,) are the new one's.
    """
    if candidate.effect in _NOISY:
        before = cost_of(problem, fit.residual, weights)[0]
        own = 2 / problem.layout.size  # position and speed
        if before - new.cost < (_NOISY_GAIN * own if candidate.where else _NOISY_ALL) * before:
            return False
    return beyond_numerics(problem, fit, new, weights)


def pruned(
    problem: Problem,
    fit: Fit,
    weights: np.ndarray,
    bound: float,
    refit: Refit,
    holdout: Holdout | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Fit:
    """The fit less effects that the others have made needless, worst first, refitting each time.

    One whose loss the others cannot make up for stays, however little the slopes at the fit say of it: far from
    the declared value they say nothing of the way back. `bound` is the z that an effect must reach. With `holdout`
    an effect also stays if held-out windows would be worse after 1 s without it.
    """
    kept: set[Candidate] = set()
    while len(kept) < len(fit.chosen):
        z = [np.inf if c in kept else wald(problem, fit, weights, i) for i, c in enumerate(fit.chosen)]
        worst = int(np.argmin(z))
        if z[worst] >= bound:
            break
        keep = [i for i in range(len(fit.chosen)) if i != worst]
        values = [fit.values[fit.slices[i]] for i in keep]
        less = refit([fit.chosen[i] for i in keep], np.concatenate(values) if values else np.empty(0))
        if costs_more_than(problem, fit, less, bound) or (holdout is not None and holdout.worse_later(fit, less)):
            kept.add(fit.chosen[worst])
            continue
        say(f"needless: {fit.chosen[worst].effect} on {fit.chosen[worst].where}")
        fit = less
    return fit


def surest(problem: Problem, fit: Fit, weights: np.ndarray) -> Fit:
    """The fit less what is not sure, the least sure first, the others moved by the slopes at `fit`."""
    while fit.chosen:
        z = certainty(problem, fit, weights) / [
            _SURE_OF_BODY if c.effect in USUAL_OF_BODIES else _SURE for c in fit.chosen
        ]
        least = int(np.argmin(z))
        if z[least] >= 1.0:
            break
        fit = without_some(problem, fit, weights, {least})
    return fit


def certainty(problem: Problem, fit: Fit, weights: np.ndarray) -> np.ndarray:
    """How many standard errors each effect (C,) is from the declared value, by its surest parameter; 0 for a trifle."""
    errors = np.sqrt(np.diag(standard_covariance(problem, fit, weights)))
    away = np.abs(fit.values - np.concatenate([c.nominal for c in fit.chosen]))
    counts = (fit.scales > 0) & (away >= _TRIFLE * fit.scales)
    z = np.where(counts, away / np.maximum(errors, 1e-300), 0.0)
    return np.array([z[part].max() for part in fit.slices])


def without_needless(problem: Problem, fit: Fit, kept: Candidate) -> Fit:
    """Less the effects that `kept` has made needless, the least sure first; forms stay."""
    while True:
        weights = window_weights(fit.clean(problem))
        spared = [c is kept or (isinstance(c, Formula) and not isinstance(kept, Formula)) for c in fit.chosen]
        z = [np.inf if s else wald(problem, fit, weights, i) for i, s in enumerate(spared)]
        worst = int(np.argmin(z))
        if z[worst] >= SURE:
            return fit
        chosen, values = without_one(fit.chosen, fit.values, fit.chosen[worst])
        fit = gauss_newton(problem, chosen, values, weights, iterations=2, coarse=True, known=fit)


def without_idle(problem: Problem, holdout: Holdout, fit: Fit) -> Fit:
    """The fit less such effects, the worst first, the others refitted without it; no worse after 1 s."""
    if holdout.problem is None or typical_power(holdout.left([fit])[0]) > _NEAR:
        return fit
    while fit.chosen:
        growth = _growth(holdout.problem, fit)
        growth[[c.effect in SATURATIONS for c in fit.chosen]] = np.inf
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
    for c in [c for c in fit.chosen if c.effect in SATURATIONS]:
        if len(fit.chosen) < 2:
            break
        less = refitted(problem, *without_one(fit.chosen, fit.values, c))
        judged = holdout.problem is not None and holdout.gains(less, fit, _IDLE_Z, _IDLE_LEAST)
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
        asked = [
            i for i, c in enumerate(fit.chosen) if share[i] < _SMALL and c.effect not in SATURATIONS and c not in kept
        ]
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
