"""Backward elimination: effects that the others have made redundant or that do not pay, dropped one by one.

One loop, `eliminate`; the functions below it say which effect goes first, how the others are fitted without it, and
when it stays all the same. What an effect gained when it was accepted may be another's in the result.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.candidates import JUDGED_ALONE, SATURATIONS, USUAL_OF_BODIES, Candidate, Formula
from bumblebee.diagnosis.comparison.compare import compare
from bumblebee.diagnosis.comparison.holdout import Holdout
from bumblebee.diagnosis.comparison.submodel import moved_without, refitted, refitted_without
from bumblebee.diagnosis.comparison.wald import costs_more_than, walds
from bumblebee.diagnosis.estimation import Fit, cost_of, gauss_newton, standard_covariance, typical_power
from bumblebee.diagnosis.residuals import Problem, window_weights

Refit = Callable[[Sequence[Candidate], np.ndarray], Fit]
"""Fits chosen candidates from their values (P,)."""


def eliminate(
    fit: Fit,
    worst: Callable[[Fit, set[Candidate]], Candidate | None],
    without: Callable[[Fit, Candidate], Fit],
    stays: Callable[[Fit, Fit], bool] = lambda fit, less: False,
    dropped: Callable[[Candidate], None] = lambda gone: None,
) -> Fit:
    """The fit less one effect after the other.

    Args:
        fit: with all effects.
        worst: the effect of a fit that goes next, of those that were not kept; None: no more.
        without: the fit without it.
        stays: whether the fit must keep what the smaller one lacks; it is not asked again.
        dropped: told of each that is gone.
    """
    kept: set[Candidate] = set()
    while (gone := worst(fit, kept)) is not None:
        less = without(fit, gone)
        if stays(fit, less):
            kept.add(gone)
        else:
            dropped(gone)
            fit = less
    return fit


def _lowest(fit: Fit, marks: Sequence[float] | np.ndarray, bound: float) -> Candidate | None:
    """The effect of the lowest mark, if that is below the bound."""
    if not len(marks):
        return None
    k = int(np.argmin(marks))
    return None if marks[k] >= bound else fit.chosen[k]


def drop_insignificant(
    problem: Problem,
    fit: Fit,
    weights: np.ndarray,
    bound: float,
    refit: Refit,
    holdout: Holdout | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Fit:
    """Less what the others have made insignificant, of the lowest z first, refitting each time.

    One whose loss the others cannot make up for stays, however little the slopes at the fit say of it: far from
    the declared value they say nothing of the way back. `bound` is the z that an effect must reach. With `holdout`
    an effect also stays if validation windows would be worse after 1 s without it. What was judged alone, by more
    windows than these, is not asked.
    """

    def worst(fit: Fit, kept: set[Candidate]) -> Candidate | None:
        asked = [c for c in fit.chosen if c not in kept and c.effect not in JUDGED_ALONE]
        return _lowest(fit, walds(problem, fit, weights, asked), bound)

    def without(fit: Fit, gone: Candidate) -> Fit:
        rest = fit.without([gone])
        return refit(rest.chosen, rest.values)

    def stays(fit: Fit, less: Fit) -> bool:
        return costs_more_than(problem, fit, less, bound) or (holdout is not None and holdout.worse_later(fit, less))

    return eliminate(fit, worst, without, stays, lambda c: say(f"removed as insignificant: {c.effect} on {c.where}"))


def drop_unsure(problem: Problem, fit: Fit, weights: np.ndarray, simulated: bool = False) -> Fit:
    """Less what is not sure, the least sure first, the others moved by the slopes at `fit`.

    Far from the declared value these may be wrong of the way back, and many that are unsure one by one may be sure
    together: where the others' moves are `simulated`, an effect without which the cost would be a share above that of
    all stays.
    """
    rule = problem.thresholds.comparison.elimination

    def worst(fit: Fit, kept: set[Candidate]) -> Candidate | None:
        bounds = [rule.sure_z_of_body if c.effect in USUAL_OF_BODIES else rule.sure_z for c in fit.chosen]
        marks = certainty(problem, fit, weights) / bounds if fit.chosen else np.empty(0)
        return _lowest(fit, [np.inf if c in kept else m for c, m in zip(fit.chosen, marks, strict=True)], 1.0)

    def without(fit: Fit, gone: Candidate) -> Fit:
        less = moved_without(problem, fit, weights, [gone])
        if not simulated:
            return less
        residual = problem.residual([less.effects])[0]
        cost, nuisance = cost_of(problem, residual, weights)
        return replace(less, residual=residual, nuisance=nuisance, cost=cost)

    most = (1 + rule.unsure_cost) * cost_of(problem, fit.residual, weights)[0]
    return eliminate(fit, worst, without, lambda fit, less: simulated and less.cost > most)


def certainty(problem: Problem, fit: Fit, weights: np.ndarray) -> np.ndarray:
    """How many standard errors each effect (C,) is from the declared value, by its surest parameter; 0 for a trifle."""
    errors = np.sqrt(np.diag(standard_covariance(problem, fit, weights)))
    away = np.abs(fit.values - np.concatenate([c.nominal for c in fit.chosen]))
    counts = (fit.scales > 0) & (away >= problem.thresholds.comparison.elimination.trifle * fit.scales)
    z = np.where(counts, away / np.maximum(errors, 1e-300), 0.0)
    return np.array([z[part].max() for part in fit.slices])


def drop_beside(problem: Problem, fit: Fit, new: Candidate) -> Fit:
    """Less the effects that `new` has made redundant, of the lowest z first; basis functions stay."""
    bound = problem.thresholds.comparison.elimination.redundant_z

    def worst(fit: Fit, kept: set[Candidate]) -> Candidate | None:
        weights = window_weights(fit.clean(problem))
        return _lowest(fit, walds(problem, fit, weights, [c for c in fit.chosen if not stays(c)]), bound)

    def stays(c: Candidate) -> bool:
        form = isinstance(c, Formula) and not isinstance(new, Formula)
        return form or c is new or c.effect in JUDGED_ALONE

    def without(fit: Fit, gone: Candidate) -> Fit:
        rest, weights = fit.without([gone]), window_weights(fit.clean(problem))
        return gauss_newton(problem, rest.chosen, rest.values, weights, iterations=2, coarse=True, known=fit)

    return eliminate(fit, worst, without)


def drop_redundant(problem: Problem, holdout: Holdout, fit: Fit) -> Fit:
    """Less what takes nothing off the validation windows' mean square, the worst first; no worse after 1 s.

    A robot that is still far from its model is left alone: there a few windows make up the mean square. So is an effect
    that the validation windows hardly feel: where a joint rests, what its rotor's inertia adds is less than the noise,
    whatever the fitted windows say of it. Saturations are asked by `drop_unpaid_saturations`: of the validation windows
    perhaps none feels them, and no slope leads back from one that nothing reaches.
    """
    rule = problem.thresholds.comparison.elimination
    if holdout.problem is None or typical_power(holdout.left([fit])[0]) > rule.near:
        return fit

    def worst(fit: Fit, kept: set[Candidate]) -> Candidate | None:
        if kept or not fit.chosen:  # one that must stay ends it
            return None
        growth, felt = _growth(holdout.judge, fit)
        growth[[c.effect in SATURATIONS for c in fit.chosen]] = np.inf
        growth[felt < rule.felt] = np.inf
        k = int(np.argmin(growth))
        return None if growth[k] > 0 else fit.chosen[k]

    return eliminate(fit, worst, lambda fit, gone: refitted_without(problem, fit, [gone], fit), holdout.worse_later)


def _growth(judge: Problem, fit: Fit) -> tuple[np.ndarray, np.ndarray]:
    """By how much (F,) the mean square of the validation windows grows without each effect, the others as they are.

    And the chi-square (F,) of what each changes there, by which a complete model's would grow.
    """
    effects = fit.effects
    sets = [effects, *([e for k, e in enumerate(effects) if k != i] for i in range(len(effects)))]
    left = judge.residual(sets) - np.tensordot(fit.nuisance, judge.nuisance, axes=1)
    power = (left**2).mean(axis=(1, 2))
    return power[1:] - power[0], ((left[1:] - left[0]) ** 2).sum(axis=(1, 2))


def drop_unpaid_saturations(problem: Problem, holdout: Holdout, fit: Fit) -> Fit:
    """Less saturations that pay no more beside the other effects, refitted without each.

    One that stood for a part of a strange friction explains nothing once that has its form.
    """
    rules, asked = problem.thresholds.comparison, [c for c in fit.chosen if c.effect in SATURATIONS]

    def worst(fit: Fit, kept: set[Candidate]) -> Candidate | None:
        return next((c for c in asked if c in fit.chosen and c not in kept), None) if len(fit.chosen) > 1 else None

    def stays(fit: Fit, less: Fit) -> bool:
        against = compare(problem, holdout, less, fit)
        judged = holdout.problem is not None and against.passes(rules.validation)
        return judged or against.passes(rules.where_felt)

    def without(fit: Fit, gone: Candidate) -> Fit:
        rest = fit.without([gone])
        return refitted(problem, rest.chosen, rest.values)

    return eliminate(fit, worst, without, stays)


def drop_unpaid(fit: Fit, refit: Refit, holdout: Holdout, problem: Problem | None = None) -> Fit:
    """Less what does not pay on the validation windows, the others refitted without it, the least first.

    Saturations are left alone: few windows feel them, of the validation windows perhaps none. Of other effects that
    these do not feel the fitted windows of `problem`, if given, decide. More than a few effects are left alone, too,
    and any where the model is still far from the data: what it lacks there spoils the comparison.
    """
    judge = holdout.problem
    if judge is None:
        return fit
    rules = judge.thresholds.comparison
    rule = rules.elimination
    if len(fit.chosen) > rule.few or typical_power(holdout.left([fit])[0]) > rule.near:
        return fit

    def worst(fit: Fit, kept: set[Candidate]) -> Candidate | None:
        if not fit.chosen:
            return None
        share = shares(holdout, fit)
        small = [i for i, c in enumerate(fit.chosen) if share[i] < rule.small_share and c not in kept]
        asked = [i for i in small if fit.chosen[i].effect not in (*SATURATIONS, *JUDGED_ALONE)]
        return fit.chosen[min(asked, key=lambda i: share[i])] if asked else None

    def without(fit: Fit, gone: Candidate) -> Fit:
        rest = fit.without([gone])
        return refit(rest.chosen, rest.values)

    def stays(fit: Fit, less: Fit) -> bool:
        against = compare(problem or judge, holdout, less, fit)
        return (problem is not None and against.passes(rules.where_rare)) or against.passes(rules.validation)

    return eliminate(fit, worst, without, stays)


def shares(holdout: Holdout, fit: Fit) -> np.ndarray:
    """(F,) of what all effects gain on the validation windows, what is lost without each, the others as they are."""
    problem = holdout.judge
    sets = [fit.effects, *([e for k, e in enumerate(fit.effects) if k != i] for i in range(len(fit.chosen))), []]
    raw = problem.residual(sets)
    left = raw - np.tensordot(fit.nuisance, problem.nuisance, axes=1)
    weights = window_weights(left[0])
    left[-1] = raw[-1] - np.tensordot(cost_of(problem, raw[-1], weights)[1], problem.nuisance, axes=1)
    power = (weights[:, None] * left**2).sum(axis=(1, 2))
    return (power[1:-1] - power[0]) / max(power[-1] - power[0], 1e-12)
