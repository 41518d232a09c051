"""Model discrepancy: what lacks after the best fit, as basis functions that are refitted in the simulator.

Basis functions are found in the whitened windows (`stepwise_regression`), with and without the catalogue's effects on
their joint: a strange effect is often half explained by an effect that it is not. The terms then join the fit like any
other effect, and what they make redundant is dropped. A discrepancy model is kept if the validation set is better with
it by more than two standard errors, if it explains most of what the joint lacked, and if it is clearly better there
than what effects of the catalogue can do in a swap (`catalogue_alternative`); else these are swapped in. What is not
kept is described, never forced into an effect of the catalogue.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from bumblebee.diagnosis.budget import Budget
from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.comparison import (
    Holdout,
    compare,
    drop_redundant,
    drop_unpaid_saturations,
    simulated_without,
    wald,
)
from bumblebee.diagnosis.discrepancy.catalogue_alternative import Offers, catalogue_swap
from bumblebee.diagnosis.discrepancy.form import DiscrepancyModel, best_model, refitted_model, short_texts
from bumblebee.diagnosis.discrepancy.residual_tests import JointActivity, JointLackOfFit, LackOfFit, lack_of_fit
from bumblebee.diagnosis.discrepancy.single_law import single_functions
from bumblebee.diagnosis.estimation import Fit, resolved
from bumblebee.diagnosis.residuals import Problem, window_weights


@dataclass(frozen=True, eq=False)
class Discovery:
    """The fit with what was discovered, and what it leaves."""

    problem: Problem
    """Its nuisances around the fit."""
    holdout: Holdout
    fit: Fit
    left: LackOfFit
    unconfirmed: dict[str, dict[str, float]]
    """Joint -> terms that were found and not kept."""
    kinds: dict[str, str]
    """Joint with a discrepancy model -> "formula" or "curve"."""
    withdrawn: list[str]
    """Effects of the catalogue that a discrepancy model or another effect made redundant."""


@dataclass(frozen=True, eq=False)
class _State:
    """A fit, problem and validation set with their nuisances around it, and what it leaves."""

    problem: Problem
    holdout: Holdout
    fit: Fit
    left: LackOfFit
    activity: JointActivity

    def around(self, fit: Fit) -> "_State":
        """The state with another fit."""
        moved = self.problem.relinearised(fit.effects)
        new = resolved(moved, fit, window_weights(fit.clean(moved)))
        validation = self.holdout.relinearised(new.effects)
        left = lack_of_fit(moved, validation.problem, new, self.activity)
        return _State(moved, validation, new, left, self.activity)


@dataclass(frozen=True, eq=False)
class _Means:
    """Candidates, time limit and progress of the search for discrepancy models."""

    offers: Offers
    budget: Budget
    say: Callable[[str], None]


def discover(
    problem: Problem,
    holdout: Holdout,
    fit: Fit,
    activity: JointActivity,
    say: Callable[[str], None] = lambda text: None,
    offers: Offers | None = None,
    budget: Budget | None = None,
) -> Discovery:
    """Test what `fit` leaves, find discrepancy models of it and refit them.

    Args:
        problem: the fitted windows.
        holdout: the validation set.
        fit: of the catalogue's effects.
        activity: of the joints.
        say: told of progress.
        offers: the catalogue's candidates conditional on `fit`.
        budget: of time; what there is none for is left out and written down there.
    """
    means = _Means(offers or Offers(), budget or Budget(), say)
    before = drop_unpaid_saturations(problem, holdout, drop_redundant(problem, holdout, fit))
    left = lack_of_fit(problem, holdout.problem, before, activity)
    state, kinds = _swapped_for_single_functions(_State(problem, holdout, before, left, activity), means)
    state, kinds, unconfirmed = _with_models(state, kinds, means)
    rest = drop_unpaid_saturations(state.problem, state.holdout, state.fit) if kinds else state.fit
    if rest is not state.fit:
        state = state.around(rest)
    gone = _with_places([c for c in before.chosen if c not in state.fit.chosen])
    return Discovery(state.problem, state.holdout, state.fit, state.left, unconfirmed, kinds, gone)


def _with_models(
    state: _State, single: dict[str, str], means: _Means
) -> tuple[_State, dict[str, str], dict[str, dict[str, float]]]:
    """The state with discrepancy models on the joints that lack most; their kinds by joint; terms that were not kept.

    `single` are joints that have one already, with its kind.
    """
    kinds, unconfirmed = dict(single), {}
    tried, rules = list(single), state.problem.thresholds.discrepancy
    for _ in range(rules.discover.joints if len(state.fit.chosen) <= rules.form.many_effects else 1):
        worst = state.left.worst(tried)
        if worst is None or not means.budget.has_time_for(f"a discrepancy model of {worst.joint}"):
            break
        tried.append(worst.joint)
        means.say(f"looking for a discrepancy model of {worst.joint}")
        model = best_model(state.problem, state.fit, state.left, worst.joint, means.budget, means.say)
        if model is None:
            continue
        after, is_swap = _validated(state, model, worst, means)
        if after is None:
            unconfirmed[worst.joint] = model.terms
            continue
        if is_swap:
            tried.remove(worst.joint)  # an effect of the catalogue may leave something that it has no effect for
            new = [c for c in after.fit.chosen if c not in state.fit.chosen]
            means.say(f"in place of a discrepancy model of {worst.joint}: {', '.join(_with_places(new))}")
        else:
            kinds[worst.joint] = model.kind
            means.say(f"discovered on {worst.joint}: {model}")
        state = after
    return state, kinds, unconfirmed


def _swapped_for_single_functions(state: _State, means: _Means) -> tuple[_State, dict[str, str]]:
    """A swap of all effects on a joint for one basis function where it explains more; such joints with its kind."""
    kinds: dict[str, str] = {}
    if len(state.fit.chosen) > state.problem.thresholds.discrepancy.form.many_effects:
        return state, kinds
    for joint in dict.fromkeys(c.where for c in state.fit.chosen if c.where in state.problem.plant.joints):
        if not means.budget.has_time_for(f"one basis function instead of the catalogue effects on {joint}"):
            break
        model = _swap_for_one_function(state, joint, means)
        if model is not None:
            state = state.around(model.fit)
            kinds[joint] = model.kind
            means.say(f"instead of catalogue effects on {joint}: {model}")
    return state, kinds


def _validated(
    state: _State, model: DiscrepancyModel, worst: JointLackOfFit, means: _Means
) -> tuple[_State | None, bool]:
    """The state with a discrepancy model, or with effects of the catalogue in a swap (then True); None if refused."""
    problem, holdout, fit = state.problem, state.holdout, state.fit
    rule = problem.thresholds.discrepancy.discover
    if not _is_worth_it(problem, holdout, fit, model, state.left.sought.bound):
        return None, False
    swapped = catalogue_swap(problem, holdout, fit, model.fit, worst.joint, means.offers, means.say)
    if swapped is not None:
        gains = compare(problem, holdout, fit, swapped).passes(problem.thresholds.comparison.validation)
        return (state.around(swapped), True) if gains else (None, False)
    means.say(f"discrepancy model of {worst.joint}: residual")
    new = state.around(model.fit)
    redundant = problem.thresholds.comparison.elimination.redundant_z
    excess = new.left.joints[problem.plant.joints.index(worst.joint)].excess
    if excess > max(rule.most_left * worst.excess, rule.noise) or _surety(new.problem, new.fit, fit) < redundant:
        return None, False
    return new, False


def _with_places(effects: Sequence[Candidate]) -> list[str]:
    """Effects with their places, for messages."""
    return [f"{c.effect} on {c.where or 'the whole robot'}" for c in effects]


def _is_worth_it(problem: Problem, holdout: Holdout, fit: Fit, model: DiscrepancyModel, bound: float) -> bool:
    """Whether a discrepancy model gains out of sample, is no trifle, and as sure as its basis function had to be."""
    rule = problem.thresholds.discrepancy.discover
    if _surety(problem, model.fit, fit) < bound:
        return False
    validation = problem.thresholds.comparison.validation
    if not compare(problem, holdout, fit, model.fit).passes(validation):
        return False
    own = next(c for c in model.fit.chosen if c not in fit.chosen)
    others = simulated_without(problem, model.fit, [own])
    return compare(problem, holdout, others, model.fit).passes(replace(validation, least_share=rule.least_of_all))


def _surety(problem: Problem, fit: Fit, before: Fit) -> float:
    """Wald's z of the discrepancy model that `fit` has and `before` has not."""
    own = next(i for i, c in enumerate(fit.chosen) if c not in before.chosen)
    return wald(problem, fit, window_weights(fit.clean(problem)), own)


def _swap_for_one_function(state: _State, joint: str, means: _Means) -> DiscrepancyModel | None:
    """One basis function that explains a joint better than the effects on it, with no more numbers; or None.

    Nor may other effects of the catalogue do what it does.
    """
    problem, holdout, fit, left = state.problem, state.holdout, state.fit, state.left
    swaps = single_functions(problem, fit, left.scene, left.library, joint)
    for gone, one in itertools.islice(swaps, problem.thresholds.discrepancy.discover.swaps):
        means.say(f"{short_texts([one])} on {joint} instead of {', '.join(c.effect for c in gone)}")
        bare = simulated_without(problem, fit, gone)
        model = refitted_model(problem, bare, joint, [one])
        rule = problem.thresholds.comparison.window_by_window
        if model is None or not compare(problem, holdout, fit, model.fit).passes(rule):
            continue
        if _surety(problem, model.fit, fit) < left.sought.bound:
            continue
        if catalogue_swap(problem, holdout, bare, model.fit, joint, means.offers, means.say) is None:
            return model
    return None
