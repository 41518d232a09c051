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
from dataclasses import dataclass, replace

import numpy as np

from bumblebee.diagnosis.acceptance import wald
from bumblebee.diagnosis.budget import Budget
from bumblebee.diagnosis.fit import Fit, resolved
from bumblebee.diagnosis.formula import formula, in_terms, related, stiffer_than_the_drive
from bumblebee.diagnosis.holdout import Holdout
from bumblebee.diagnosis.idle import without_idle, without_spent
from bumblebee.diagnosis.instead import Offers, is_better, named_instead
from bumblebee.diagnosis.laws import beside, joined
from bumblebee.diagnosis.problem import Problem, window_weights
from bumblebee.diagnosis.refits import PARAMETER, SURE, less, refitted, score, without_needless, without_one
from bumblebee.diagnosis.remains import Remains, remains
from bumblebee.diagnosis.scene import fitted_scene
from bumblebee.diagnosis.seek import Found, library, seek
from bumblebee.diagnosis.several import single_laws

_JOINTS = 3  # joints at most that get a form
_MANY = 8  # effects in a fit beyond which one joint does, names stay, inner numbers too: every trial refits them all
_Z, _LEAST = 2.0, 0.01  # of the judging windows' gain, and its least share
_OF_ALL = 0.05  # share of what all effects gain together that a form must, what it replaces being gone
_MOST = 0.5  # share of a joint's excess that may remain where its form was found
_LAWS, _WORTH, _SHARE = 3, 12.0, 0.03  # laws in a form; what a further one must bring, and as a share of the first's
_TRIALS = 2  # laws tried at most in the place of names on one joint
_PART = 0.2  # an effect of the catalogue is a part of a law that is at least this share of it


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
class _Form:
    """One way to explain a joint."""

    fit: Fit
    score: float
    kind: str
    terms: dict[str, float]


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
    budget = budget or Budget()
    fit = without_spent(problem, holdout, without_idle(problem, holdout, fit))
    left = remains(problem, holdout.problem, fit, typical, still)
    unconfirmed: dict[str, dict[str, float]] = {}
    kinds: dict[str, str] = {}
    before = fit
    few = len(fit.chosen) <= _MANY
    for joint in dict.fromkeys(c.where for c in fit.chosen if few and c.where in problem.plant.joints):
        if not budget.has_time_for(f"one law in the place of the names on {joint}"):
            break
        form = _instead_of_names(problem, holdout, fit, left, joint, offers or Offers())
        if form is not None:
            problem, holdout, fit, left = _around(problem, holdout, form.fit, typical, still)
            kinds[joint] = form.kind
            say(f"in the place of names on {joint}: {_sum(form)}")
    tried = list(kinds)
    for _ in range(_JOINTS if len(fit.chosen) <= _MANY else 1):
        worst = left.worst(tried)
        if worst is None:
            break
        tried.append(worst.joint)
        if not budget.has_time_for(f"a law on {worst.joint}"):
            break
        say(f"looking for a law on {worst.joint}")
        form = _best_form(problem, fit, left, worst.joint, typical, budget)
        if form is None:
            continue
        if not _is_worth_it(problem, holdout, fit, form, left.sought.bound):
            unconfirmed[worst.joint] = form.terms
            continue
        named = named_instead(problem, holdout, fit, form.fit, worst.joint, offers or Offers())
        if named is not None and not holdout.gains(fit, named, _Z, _LEAST):
            unconfirmed[worst.joint] = form.terms
            continue
        best = named or form.fit
        moved, judged, new, rest = _around(problem, holdout, best, typical, still)
        column = problem.plant.joints.index(worst.joint)
        if named is None and (
            rest.joints[column].excess > max(_MOST * worst.excess, 2.0) or _surety(moved, new, fit) < SURE
        ):
            unconfirmed[worst.joint] = form.terms
            continue
        if named is None:
            kinds[worst.joint] = form.kind
            say(f"discovered on {worst.joint}: {_sum(form)}")
        else:
            tried.remove(worst.joint)  # a name may leave something that has none
            names = [f"{c.effect} on {c.where or 'the whole robot'}" for c in named.chosen if c not in fit.chosen]
            say(f"in a form's place on {worst.joint}: {', '.join(names)}")
        problem, holdout, fit, left = moved, judged, new, rest
    rest = without_spent(problem, holdout, fit) if kinds else fit
    if rest is not fit:
        problem, holdout, fit, left = _around(problem, holdout, rest, typical, still)
    gone = [c for c in before.chosen if c not in fit.chosen]
    names = [f"{c.effect} on {c.where or 'the whole robot'}" for c in gone]
    return Discovery(problem, holdout, fit, left, unconfirmed, kinds, names)


def _is_worth_it(problem: Problem, holdout: Holdout, fit: Fit, form: _Form, bound: float) -> bool:
    """Whether a form pays on the judging windows, is no trifle, and as sure in the joint fit as its law had to be."""
    if _surety(problem, form.fit, fit) < bound:
        return False
    if not holdout.gains(fit, form.fit, _Z, _LEAST):
        return False
    own = next(c for c in form.fit.chosen if c not in fit.chosen)
    return holdout.gains(less(problem, form.fit, [own]), form.fit, _Z, _OF_ALL)


def _surety(problem: Problem, fit: Fit, before: Fit) -> float:
    """Wald's z of the form that `fit` has and `before` has not."""
    own = next(i for i, c in enumerate(fit.chosen) if c not in before.chosen)
    return wald(problem, fit, window_weights(fit.clean(problem)), own)


def _around(
    problem: Problem, holdout: Holdout, fit: Fit, typical: np.ndarray, still: Sequence[str]
) -> tuple[Problem, Holdout, Fit, Remains]:
    """Problem, judges and fit with their nuisances around a new fit, and what that leaves."""
    moved = problem.relinearised(fit.effects)
    new = resolved(moved, fit, window_weights(fit.clean(moved)))
    judged = holdout.relinearised(new.effects)
    return moved, judged, new, remains(moved, judged.problem, new, typical, still)


def _sum(form: _Form) -> str:
    """The form in a line."""
    return " + ".join(f"{v:.3g} {t}" for t, v in form.terms.items())[:100]


def _instead_of_names(
    problem: Problem, holdout: Holdout, fit: Fit, left: Remains, joint: str, offers: Offers
) -> _Form | None:
    """One law that explains a joint better than the catalogue's effects on it, with no more numbers; or None.

    Nor may other effects of the catalogue do what it does.
    """
    laws = single_laws(problem, fit, left.scene, left.library, joint)
    for gone, one in itertools.islice(laws, _TRIALS):
        bare = less(problem, fit, gone)
        form = _form(problem, bare, joint, [one])
        if form is None or not is_better(problem, holdout, fit, form.fit):
            continue
        if _surety(problem, form.fit, fit) < left.sought.bound:
            continue
        if named_instead(problem, holdout, bare, form.fit, joint, offers) is None:
            return form
    return None


def _best_form(
    problem: Problem, fit: Fit, left: Remains, joint: str, typical: np.ndarray, budget: Budget
) -> _Form | None:
    """The form that explains the fitted windows best for its parameters; None where no strange law was found."""
    column = problem.plant.joints.index(joint)
    ways: list[tuple[Fit, list[Found]]] = [(fit, [f for f in left.sought.found if f.joint == column])]
    ways += [(fit, [rival]) for rival in left.sought.rivals if rival.joint == column]
    own = [c for c in fit.chosen if c.where == joint]
    if own:
        bare = less(problem, fit, own)
        scene = fitted_scene(problem, bare, typical, [column])
        some = library(scene.data, [column])
        sought = seek(problem, scene.evidence, scene.residual, scene.columns, some, most=_LAWS)
        ways += [(bare, sought.found), (fit, sought.found), *((bare, [rival]) for rival in sought.rivals)]
    forms = [_growing(problem, base, joint, found, budget) for base, found in ways]
    return max((f for f in forms if f is not None), key=lambda f: f.score, default=None)


def _growing(problem: Problem, base: Fit, joint: str, found: Sequence[Found], budget: Budget) -> _Form | None:
    """The form of as many of the laws as are worth it, in the order in which they were found."""
    there = {c.effect for c in base.chosen if c.where == joint}
    strange = [f for f in found if not f.law.known or f.law.known in there]
    best, start = None, score(problem, base)
    for count in range(1, min(len(strange), _LAWS) + 1):
        if not budget.has_time_for(f"all forms on {joint}"):
            break
        form = _form(problem, base, joint, strange[:count])
        if form is None:
            break
        if count == 1 and len(base.chosen) <= _MANY:
            form = _climbed(problem, base, joint, strange[0], form, budget)
        if best is not None and form.score - best.score < max(_WORTH, _SHARE * (best.score - start)):
            break
        best = form
    return best


def _climbed(problem: Problem, base: Fit, joint: str, one: Found, form: _Form, budget: Budget) -> _Form:
    """The form at the best of the law's two inner numbers, from neighbour to neighbour."""
    seen, law = {one.law.texts}, one.law
    while budget.has_time_for(f"the best inner numbers of a form on {joint}"):
        tried = {}
        for other in beside(law):
            if other.texts not in seen:
                seen.add(other.texts)
                tried[other] = _form(problem, base, joint, [replace(one, law=other)])
        best = max((f for f in tried.values() if f is not None), key=lambda f: f.score, default=None)
        if best is None or best.score < form.score + PARAMETER:
            return form
        law, form = next(other for other, f in tried.items() if f is best), best
    return form


def _form(problem: Problem, base: Fit, joint: str, strange: Sequence[Found]) -> _Form | None:
    """`base` with strange laws, refitted; effects that became needless are dropped."""
    terms: dict[str, float] = {}
    for one in strange:
        for text, size in zip(*joined(list(one.law.texts), one.verdict.size), strict=True):
            terms[text] = float(size)
    kind = "curve" if any(one.law.table for one in strange) else "formula"
    chosen, values = base.chosen, base.values
    for c in [c for c in chosen if c.where == joint and related(list(terms), c.effect)]:
        parts = in_terms(problem.plant, base, c)
        if parts and max(map(abs, terms.values())) > _PART * max(map(abs, parts.values())):
            chosen, values = without_one(chosen, values, c)
            terms = parts | terms
    own = formula(joint, terms)
    fit = refitted(problem, (*chosen, own), np.concatenate((values, list(terms.values()))), base)
    fit = without_needless(problem, fit, own)
    if own not in fit.chosen or stiffer_than_the_drive(problem.plant, own, fit.of(own)):
        return None
    return _Form(fit, score(problem, fit), kind, dict(zip(own.texts, map(float, fit.of(own)), strict=True)))
