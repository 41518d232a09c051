"""Beyond the catalogue: what remains after the best fit, its form, and that form refitted in the simulator.

A law is found in the whitened windows (`diagnosis/seek.py`), with and without the catalogue's effects on its joint: a
strange effect is often half explained by a name that it has not. Its terms then join the fit like any other effect,
and what they make needless is dropped. The form is kept if the windows that took no part in the fit are better with it
by more than two standard errors, if it explains most of what the joint lacked, and if it is clearly better there than
what effects of the catalogue can do in its place (`diagnosis/instead.py`); else these take it. What is not kept is
described, never forced into a name.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.budget import Budget
from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.comparison import SURE, Holdout, is_better, less, wald, without_idle, without_spent
from bumblebee.diagnosis.discrepancy.catalogue_alternative import Offers, named_instead
from bumblebee.diagnosis.discrepancy.form import Form, best_form, form_of
from bumblebee.diagnosis.discrepancy.residual_tests import JointRemains, Remains, remains
from bumblebee.diagnosis.discrepancy.single_law import single_laws
from bumblebee.diagnosis.estimation import Fit, resolved
from bumblebee.diagnosis.residuals import Problem, window_weights


@dataclass(frozen=True, eq=False)
class Discovery:
    """The fit with what was discovered, and what it leaves."""

    problem: Problem
    """Its nuisances around the fit."""
    holdout: Holdout
    fit: Fit
    left: Remains
    unconfirmed: dict[str, dict[str, float]]
    """Joint -> terms that were found and not kept."""
    kinds: dict[str, str]
    """Joint with a form -> "formula" or "curve"."""
    withdrawn: list[str]
    """Effects of the catalogue that a form or another name made needless."""


@dataclass(frozen=True, eq=False)
class _State:
    """A fit, problem and judges with their nuisances around it, and what it leaves."""

    problem: Problem
    holdout: Holdout
    fit: Fit
    left: Remains
    typical: np.ndarray
    still: Sequence[str]

    def around(self, fit: Fit) -> "_State":
        """The same of another fit."""
        moved = self.problem.relinearised(fit.effects)
        new = resolved(moved, fit, window_weights(fit.clean(moved)))
        judged = self.holdout.relinearised(new.effects)
        left = remains(moved, judged.problem, new, self.typical, self.still)
        return _State(moved, judged, new, left, self.typical, self.still)


def discover(
    problem: Problem,
    holdout: Holdout,
    fit: Fit,
    typical: np.ndarray,
    still: Sequence[str] = (),
    say: Callable[[str], None] = lambda text: None,
    offers: Offers | None = None,
    budget: Budget | None = None,
) -> Discovery:
    """Test, name and refit what `fit` leaves; arguments as of `remains`, and the catalogue's `offers` beside `fit`.

    What there is no time for in `budget` is left out and written down there.
    """
    budget, offers = budget or Budget(), offers or Offers()
    before = without_spent(problem, holdout, without_idle(problem, holdout, fit))
    left = remains(problem, holdout.problem, before, typical, still)
    state, kinds = _without_names(_State(problem, holdout, before, left, typical, still), offers, budget, say)
    unconfirmed: dict[str, dict[str, float]] = {}
    tried = list(kinds)
    rules = problem.thresholds.discrepancy
    for _ in range(rules.discover.joints if len(state.fit.chosen) <= rules.form.many_effects else 1):
        worst = state.left.worst(tried)
        if worst is None or not budget.has_time_for(f"a law on {worst.joint}"):
            break
        tried.append(worst.joint)
        say(f"looking for a law on {worst.joint}")
        form = best_form(state.problem, state.fit, state.left, worst.joint, typical, budget)
        if form is None:
            continue
        after, named = _judged(state, form, worst, offers)
        if after is None:
            unconfirmed[worst.joint] = form.terms
            continue
        if named:
            tried.remove(worst.joint)  # a name may leave something that has none
            new = [c for c in after.fit.chosen if c not in state.fit.chosen]
            say(f"in a form's place on {worst.joint}: {', '.join(_names(new))}")
        else:
            kinds[worst.joint] = form.kind
            say(f"discovered on {worst.joint}: {form}")
        state = after
    rest = without_spent(state.problem, state.holdout, state.fit) if kinds else state.fit
    if rest is not state.fit:
        state = state.around(rest)
    gone = _names([c for c in before.chosen if c not in state.fit.chosen])
    return Discovery(state.problem, state.holdout, state.fit, state.left, unconfirmed, kinds, gone)


def _without_names(
    state: _State, offers: Offers, budget: Budget, say: Callable[[str], None]
) -> tuple[_State, dict[str, str]]:
    """One law in the place of all names on a joint where it explains more; joints that got one, with its kind."""
    kinds: dict[str, str] = {}
    if len(state.fit.chosen) > state.problem.thresholds.discrepancy.form.many_effects:
        return state, kinds
    for joint in dict.fromkeys(c.where for c in state.fit.chosen if c.where in state.problem.plant.joints):
        if not budget.has_time_for(f"one law in the place of the names on {joint}"):
            break
        form = _instead_of_names(state, joint, offers)
        if form is not None:
            state = state.around(form.fit)
            kinds[joint] = form.kind
            say(f"in the place of names on {joint}: {form}")
    return state, kinds


def _judged(state: _State, form: Form, worst: JointRemains, offers: Offers) -> tuple[_State | None, bool]:
    """The state with a form, or with effects of the catalogue that do what it does (then True); None if refused."""
    problem, holdout, fit = state.problem, state.holdout, state.fit
    rule = problem.thresholds.discrepancy.discover
    if not _is_worth_it(problem, holdout, fit, form, state.left.sought.bound):
        return None, False
    named = named_instead(problem, holdout, fit, form.fit, worst.joint, offers)
    if named is not None:
        return (state.around(named), True) if holdout.gains(fit, named, rule.gain_z, rule.least_gain) else (None, False)
    new = state.around(form.fit)
    excess = new.left.joints[problem.plant.joints.index(worst.joint)].excess
    if excess > max(rule.most_left * worst.excess, rule.noise) or _surety(new.problem, new.fit, fit) < SURE:
        return None, False
    return new, False


def _names(effects: Sequence[Candidate]) -> list[str]:
    """Effects with their places, for messages."""
    return [f"{c.effect} on {c.where or 'the whole robot'}" for c in effects]


def _is_worth_it(problem: Problem, holdout: Holdout, fit: Fit, form: Form, bound: float) -> bool:
    """Whether a form pays on the judging windows, is no trifle, and as sure in the joint fit as its law had to be."""
    rule = problem.thresholds.discrepancy.discover
    if _surety(problem, form.fit, fit) < bound:
        return False
    if not holdout.gains(fit, form.fit, rule.gain_z, rule.least_gain):
        return False
    own = next(c for c in form.fit.chosen if c not in fit.chosen)
    return holdout.gains(less(problem, form.fit, [own]), form.fit, rule.gain_z, rule.least_of_all)


def _surety(problem: Problem, fit: Fit, before: Fit) -> float:
    """Wald's z of the form that `fit` has and `before` has not."""
    own = next(i for i, c in enumerate(fit.chosen) if c not in before.chosen)
    return wald(problem, fit, window_weights(fit.clean(problem)), own)


def _instead_of_names(state: _State, joint: str, offers: Offers) -> Form | None:
    """One law that explains a joint better than the catalogue's effects on it, with no more numbers; or None.

    Nor may other effects of the catalogue do what it does.
    """
    problem, holdout, fit, left = state.problem, state.holdout, state.fit, state.left
    laws = single_laws(problem, fit, left.scene, left.library, joint)
    for gone, one in itertools.islice(laws, problem.thresholds.discrepancy.discover.swaps):
        bare = less(problem, fit, gone)
        form = form_of(problem, bare, joint, [one])
        if form is None or not is_better(problem, holdout, fit, form.fit):
            continue
        if _surety(problem, form.fit, fit) < left.sought.bound:
            continue
        if named_instead(problem, holdout, bare, form.fit, joint, offers) is None:
            return form
    return None
