"""The last fit: everything whitened and linearised around what was found."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bumblebee.diagnosis.candidates import ABRUPT, JUDGED_ALONE, SATURATIONS, Candidate, effects_at
from bumblebee.diagnosis.comparison import Holdout, drop_insignificant, drop_unpaid
from bumblebee.diagnosis.estimation import Fit, cost_of, gauss_newton, interval, last_step, moves
from bumblebee.diagnosis.residuals import Problem, make_problem, window_weights
from bumblebee.diagnosis.selection.proposals.hysteresis_law import KIND as HYSTERESIS
from bumblebee.diagnosis.selection.proposals.hysteresis_law import has_other_law, other_law
from bumblebee.diagnosis.selection.proposals.surface_contact import is_still_confirmed
from bumblebee.errors import BadInput


@dataclass(frozen=True, eq=False)
class OtherLaw:
    """Another law of a chosen effect, which fits as well."""

    values: np.ndarray
    """(p,) its parameters."""
    half: np.ndarray
    """(p,) of 95 % intervals."""


@dataclass(frozen=True, eq=False)
class Refined:
    """The final fit, its problem and the intervals' half-widths."""

    problem: Problem
    fit: Fit
    weights: np.ndarray
    half: np.ndarray
    """(P,) of 95 % intervals; 0 for parameters that were not fitted."""
    other_laws: Mapping[Candidate, OtherLaw] = field(default_factory=dict)
    """Alternative law of an effect and what it comes to, where these data refute neither."""


def _around(problem: Problem, fit: Fit, rng: np.random.Generator) -> Problem:
    """The problem whitened around `fit` where it changed much and its model stays finite from noisy starts.

    Else only its nuisances are computed anew.
    """
    share = problem.thresholds.selection.final_fit.changed
    if fit.cost < share * cost_of(problem, problem.residual([[]])[0], window_weights(fit.clean(problem)))[0]:
        plant, layout, windows = problem.plant, problem.layout, problem.read
        steps, rules = (problem.finest, problem.coarsest), problem.thresholds
        try:
            made = make_problem(plant, layout, windows, problem.sigma, steps, fit.effects, rng, thresholds=rules)
            return replace(made, between=problem.between)
        except BadInput:  # stiff and coarsely stepped, it diverges in more than half of the windows
            pass
    return problem.finely().relinearised(fit.effects)


def _settled(problem: Problem, fit: Fit, rng: np.random.Generator) -> tuple[Problem, Fit, np.ndarray]:
    """Problem, fit and window weights (W,) after whitening and fitting in turn, until the fit stays where it is.

    Windows weigh by what a fit leaves of them, and are whitened around it: both favour the fit that they are taken
    from. A limit of 0.543 N m, which few windows feel, came out as 0.594, and as 0.540 once it had settled. Where no
    window's prediction has moved, whitening it again gives the same again: another draw of signs moved three effects of
    a standing robot by 0.04 to 0.5 of their half-widths, for a fifth of the diagnosis's time.
    """
    rule = problem.thresholds.selection.final_fit
    for _ in range(rule.rounds):
        before, last = fit.values, problem
        problem = _around(problem, fit, rng)
        residual = problem.residual([fit.effects])[0]
        _, nuisance = cost_of(problem, residual, window_weights(residual))
        weights = window_weights(residual - np.tensordot(nuisance, problem.nuisance, axes=1))
        held = _held_slopes(problem, fit)
        fit = gauss_newton(problem, fit.chosen, before, weights, iterations=3, coarse=True, held=held)
        fit, weights = _weighed(problem, fit)
        anew = problem.whitener is not last.whitener
        if not anew or _is_near(problem, fit, before) or _is_still(problem, fit, weights, before, rule.still):
            break
    return problem, fit, weights


def _is_near(problem: Problem, fit: Fit, before: np.ndarray) -> bool:
    """Whether no window tells the fit from its values `before` (P,), around which it was whitened."""
    change = problem.residual([effects_at(fit.chosen, before)])[0] - fit.residual
    return bool((change**2).mean(axis=1).max() < problem.thresholds.selection.final_fit.same)


def _weighed(problem: Problem, fit: Fit) -> tuple[Fit, np.ndarray]:
    """The fit with its windows weighed (W,) by what it leaves of them itself, to where that changes little."""
    rule, held = problem.thresholds.selection.final_fit, _held_slopes(problem, fit)
    for _ in range(rule.weighed):
        before, weights = fit.values, window_weights(fit.clean(problem))
        fit = gauss_newton(problem, fit.chosen, before, weights, iterations=2, coarse=True, known=fit, held=held)
        if _is_still(problem, fit, weights, before, rule.steady):
            break
    return fit, weights


def _is_still(problem: Problem, fit: Fit, weights: np.ndarray, before: np.ndarray, share: float) -> bool:
    """Whether no value has moved from `before` (P,) by more than a `share` of its interval's half-width."""
    return bool((np.abs(fit.values - before) <= share * interval(problem, fit, weights)).all())


def refine(problem: Problem, fit: Fit, rng: np.random.Generator, holdout: Holdout | None = None) -> Refined:
    """Whiten and linearise around `fit`, and fit again; a fit of nothing is as it should be already.

    A model that was nearly right before is whitened well enough: there only the nuisances are computed anew.
    """
    if not fit.chosen:
        if problem.fine != problem.finest:
            problem = problem.finely().relinearised([])
            fit = gauss_newton(problem, (), (), window_weights(problem.residual([[]])[0]))
        return Refined(problem, fit, window_weights(fit.clean(problem)), np.empty(0))
    found, many = fit, _is_many(problem, fit)
    problem, fit, weights = _settled(problem, fit, rng)
    whole = fit if many else last_step(problem, fit.chosen, fit.values, weights)
    fit = _significant(problem, whole, weights)
    if holdout is not None:
        fit = drop_unpaid(fit, _refit_near(problem, whole, weights), holdout, problem)
    if fit.chosen != whole.chosen and not many:
        fit = last_step(problem, fit.chosen, fit.values, weights)
    astray = holdout is not None and holdout.worse_later(_with_nuisance(problem, found, weights), fit)
    if astray:  # by short windows alone, as another step would be
        fit = gauss_newton(problem, found.chosen, found.values, weights, iterations=0)
    if holdout is not None:
        fit = _confirmed(problem, fit, weights, holdout)
    last = _sure_of(problem, fit, weights)
    if not many or astray or not last.fit.chosen:
        return last
    fit = last_step(problem, last.fit.chosen, last.fit.values, weights)
    return Refined(problem, fit, weights, half_widths(problem, fit, weights))


def _confirmed(problem: Problem, fit: Fit, weights: np.ndarray, holdout: Holdout) -> Fit:
    """The fit less the contacts that no more make better what they change, the last found first."""
    for c in [c for c in reversed(fit.chosen) if c.effect in JUDGED_ALONE]:
        if not is_still_confirmed(problem, fit, c, holdout):
            rest = fit.without([c])
            fit = last_step(problem, rest.chosen, rest.values, weights)
    return fit


def _refit_near(problem: Problem, known: Fit, weights: np.ndarray) -> Callable[[Sequence[Candidate], np.ndarray], Fit]:
    """Fits of some effects from their values (P,), by the sensitivities of a `known` fit of more."""
    held = _held_slopes(problem, known)

    def refit(chosen: Sequence[Candidate], values: np.ndarray) -> Fit:
        return gauss_newton(problem, chosen, values, weights, iterations=1, coarse=True, known=known, held=held)

    return refit


def _significant(problem: Problem, fit: Fit, weights: np.ndarray) -> Fit:
    """The fit less what the others make insignificant."""
    sure = problem.thresholds.selection.final_fit.sure
    return drop_insignificant(problem, fit, weights, sure, _refit_near(problem, fit, weights))


def _sure_of(problem: Problem, fit: Fit, weights: np.ndarray, needed: frozenset[Candidate] = frozenset()) -> Refined:
    """The fit with its intervals, less what these do not bear out: limits and gaps at once, then one by one.

    A single odd window may find a limit or a gap that explains it: a torque limit of 39 N m in the place of 50, with an
    interval from none to 5e8. Other effects go where the windows alone are sure of them and another integrator would
    have found as much: an implicit servo damps as a rotor does, and beside six gains three armatures were named a third
    below the declared ones. What the windows themselves leave open was fitted together with others and stays. So does
    what is `needed`: without it the others leave much more, which no integrator does, however far it would move a size.
    """
    alone = interval(problem, fit, weights) if fit.chosen else np.empty(0)
    half = half_widths(problem, fit, weights) if fit.chosen else np.empty(0)
    rare = [c for c in fit.chosen if c.effect in (*SATURATIONS, *ABRUPT) and c.effect not in JUDGED_ALONE]
    unsure = [c for c in rare if _sureness(fit, half, c) < 1.0]
    if unsure:
        return _sure_of(problem, _less(problem, fit, weights, unsure), weights, needed)
    asked = [c for c in fit.chosen if c.effect not in JUDGED_ALONE and c not in needed]
    feigned = [c for c in asked if _sureness(fit, half, c) < 1.0 <= _sureness(fit, alone, c)]
    most = (1 + problem.thresholds.selection.final_fit.feigned) * fit.cost
    for c in sorted(feigned, key=lambda c: _sureness(fit, half, c)):
        less = _less(problem, fit, weights, [c])
        if less.cost <= most:
            return _sure_of(problem, less, weights, needed)
        needed |= {c}
    return Refined(problem, fit, weights, half)


def _less(problem: Problem, fit: Fit, weights: np.ndarray, gone: Sequence[Candidate]) -> Fit:
    """The last step without some effects, and without what is insignificant then; of many effects a refit by slopes.

    A last step simulates every parameter to either side: of many effects it is made once, at the end.
    """
    rest = fit.without(gone)
    if _is_many(problem, rest):
        return _refit_near(problem, fit, weights)(rest.chosen, rest.values)
    whole = last_step(problem, rest.chosen, rest.values, weights)
    less = _significant(problem, whole, weights)
    return whole if less.chosen == whole.chosen else last_step(problem, less.chosen, less.values, weights)


def _is_many(problem: Problem, fit: Fit) -> bool:
    """Whether a fit has so many effects that a last step takes minutes."""
    return len(fit.chosen) > problem.thresholds.selection.final_fit.many


def _held_slopes(problem: Problem, fit: Fit) -> Sequence[Candidate]:
    """Effects whose sensitivities, simulated once, hold wherever the fit goes: all where there are many, else none."""
    return fit.chosen if _is_many(problem, fit) else ()


def _sureness(fit: Fit, half: np.ndarray, candidate: Candidate) -> float:
    """How many half-widths of its interval the surest of its free parameters is from the declared value."""
    part, free = fit.slices[fit.chosen.index(candidate)], list(candidate.free)
    if not free:
        return np.inf
    away = np.abs(fit.values[part] - np.array(candidate.nominal))[free]
    return float((away / np.maximum(half[part][free], 1e-300)).max())


def _with_nuisance(problem: Problem, fit: Fit, weights: np.ndarray) -> Fit:
    """A fit of the search with the numerical differences that it has in the steps of the last fit."""
    return replace(fit, nuisance=cost_of(problem, problem.residual([fit.effects])[0], weights)[1])


def with_other_laws(last: Refined, holdout: Holdout, candidates: Sequence[Candidate]) -> Refined:
    """The last fit with the other law of each hysteresis, where one of `candidates` has it and it is not refuted."""
    others: dict[Candidate, OtherLaw] = {}
    for c in last.fit.chosen:
        if c.effect != HYSTERESIS or not has_other_law(candidates, c):
            continue
        other = other_law(last.problem, holdout, last.fit, c, last.weights)
        if other is not None:
            own = other.slices[-1]
            others[c] = OtherLaw(other.values[own], half_widths(last.problem, other, last.weights)[own])
    return replace(last, other_laws=others)


def half_widths(problem: Problem, fit: Fit, weights: np.ndarray) -> np.ndarray:
    """Half-widths (P,) of 95 % intervals, what another integrator would have found included.

    The truth is neither: both are correct to first order in the step, so what lies between them is a standard deviation
    of what either may be off, whatever the number of windows. It is a tenth of the width on an arm, more than the whole
    for a limit that few windows reach.
    """
    return np.hypot(interval(problem, fit, weights), 1.96 * moves(problem, fit, weights))
