"""A swap of a discrepancy model for effects of the catalogue, tried before the model is kept.

A discrepancy model has more freedom than any effect of the catalogue and is sought among thousands: where the true
effect was refused by a hair, some model explains nearly as much of the fitted windows. An effect of the catalogue says
more than a formula, so a discrepancy model must be clearly better than the best that such effects can do, on windows
that took no part in either fit.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, Formula, is_chosen, shortlisted
from bumblebee.diagnosis.comparison import (
    Holdout,
    costs_more_than,
    criterion,
    drop_beside,
    evidence,
    lead,
    parameters,
    refitted,
    wald,
)
from bumblebee.diagnosis.estimation import Fit, gauss_newton, resolved
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.diagnosis.selection import Search, score_tests, try_one
from bumblebee.diagnosis.sensitivities import Columns
from bumblebee.diagnosis.simulation import Plant
from bumblebee.diagnosis.thresholds.discrepancy import CatalogueAlternative


@dataclass(frozen=True, eq=False)
class Offers:
    """The catalogue's candidates with what the search's screening promised of each."""

    candidates: Sequence[Candidate] = ()
    """The most promising first."""

    def on(self, plant: Plant, joint: str, rule: CatalogueAlternative) -> list[Candidate]:
        """Those that could act on a joint, a few shapes of each; and the most promising wherever they are.

        What sits on another joint or on a body that the joint does not carry is left out.
        """
        elsewhere = (set(plant.joints) | set(plant.bodies)) - {joint, *_carried(plant, joint)}
        best = list(dict.fromkeys((c.effect, c.where) for c in self.candidates))[: rule.anywhere]
        kept: list[Candidate] = []
        for c in self.candidates:
            if c.where in elsewhere and (c.effect, c.where) not in best:
                continue
            if sum((c.effect, c.where) == (o.effect, o.where) for o in kept) < rule.shapes:
                kept.append(c)
        return kept


def offers_of(found: Search, candidates: Sequence[Candidate]) -> Offers:
    """The search's candidates by their gain conditional on what was found, and those that are never screened."""
    order = np.argsort(-found.tests.gain)
    screened = [found.columns.candidates[k] for k in order if found.tests.gain[k] > 0]
    return Offers([*screened, *(c for c in candidates if shortlisted(c, len(found.problem.plant.joints)))])


def with_catalogue_effects(found: Search, fit: Fit) -> Search:
    """The search as if it had found what the catalogue's effects of `fit` are, with evidence for those that are new."""
    chosen = [c for c in fit.chosen if not isinstance(c, Formula)]
    if set(chosen) <= set(found.fit.chosen):
        return found
    values = np.concatenate([fit.of(c) for c in chosen])
    joint = gauss_newton(found.problem, chosen, values, found.weights, iterations=0, coarse=True)
    known = {s.candidate: s for s in found.steps}
    steps = [
        known.get(c) or evidence(c, wald(found.problem, joint, found.weights, i), found.count)
        for i, c in enumerate(chosen)
    ]
    return replace(found, fit=joint, steps=steps)


def catalogue_swap(
    problem: Problem,
    holdout: Holdout,
    fit: Fit,
    model: Fit,
    joint: str,
    offers: Offers,
    say: Callable[[str], None] = lambda text: None,
) -> Fit | None:
    """`fit` with one or two more effects of the catalogue that do what a discrepancy model does; None where none can.

    Args:
        problem: the fitted windows.
        holdout: the validation set.
        fit: without the discrepancy model.
        model: the fit with it.
        joint: where it is.
        offers: the catalogue's candidates conditional on `fit`.
        say: told of progress.
    """
    rule, swapped = problem.thresholds.discrepancy.catalogue_alternative, fit
    for _ in range(rule.rounds):
        new = _one_more(problem, swapped, joint, offers, say)
        if new is None:
            return None
        swapped = new
        short = lead(problem, holdout, model, swapped)
        if short <= (rule.lacking if parameters(swapped) <= parameters(model) else 0.0):
            return swapped
        # A table has a height for everything: effects that explain the fit better for their numbers go before it.
        if criterion(problem, swapped) >= criterion(problem, model):
            return swapped
        if short > rule.hopeless:
            return None
    return None


def _one_more(problem: Problem, fit: Fit, joint: str, offers: Offers, say: Callable[[str], None]) -> Fit | None:
    """The best of the catalogue's effects conditional on `fit`, if any is worth its parameters."""
    rule = problem.thresholds.discrepancy.catalogue_alternative
    open_ = [c for c in offers.on(problem.plant, joint, rule) if not is_chosen(c, fit.chosen)]
    many = len(problem.plant.joints)
    kinds = list(dict.fromkeys((c.effect, c.where) for c in open_ if not shortlisted(c, many)))[: rule.effects]
    looked = [c for c in open_ if (c.effect, c.where) in kinds or (shortlisted(c, many) and c.where == joint)]
    if not looked:
        return None
    columns = Columns(looked, problem.sensitivities(looked, fit.effects))
    weights = window_weights(fit.clean(problem))
    tests = score_tests(problem, columns, fit, weights)
    order = [k for k in np.argsort(-tests.gain) if tests.gain[k] > 0][: rule.trials]
    trials = []
    for k in order:
        say(f"trying {_with_place(looked[k])} in place of a discrepancy model of {joint}")
        trials.append(try_one(problem, fit, looked[k], tests.steps[k], weights))
    tried = sorted((t for t in trials if t is not None), key=lambda t: t.cost + 2 * len(t.candidate.free))[: rule.fits]
    fits = []
    for t in tried:
        say(f"refitting with {_with_place(t.candidate)} in place of a discrepancy model of {joint}")
        new = refitted(problem, (*fit.chosen, t.candidate), np.concatenate((fit.values, t.values)), fit)
        new = drop_beside(problem, new, t.candidate)
        if _is_sure(problem, fit, new, t.candidate):
            fits.append(new)
    best = max(fits, key=lambda f: criterion(problem, f), default=None)
    return best if best is not None and criterion(problem, best) > criterion(problem, fit) else None


def _with_place(candidate: Candidate) -> str:
    """An effect and its place, for messages."""
    return f"{candidate.effect} on {candidate.where or 'the whole robot'}"


def _is_sure(problem: Problem, fit: Fit, new: Fit, candidate: Candidate) -> bool:
    """Whether an effect that `new` has beside `fit` is beyond doubt, by its slopes or by what its loss costs."""
    weights, sure = window_weights(new.clean(problem)), problem.thresholds.comparison.elimination.redundant_z
    if wald(problem, new, weights, new.chosen.index(candidate)) >= sure:
        return True
    return costs_more_than(problem, resolved(problem, new, weights), resolved(problem, fit, weights), sure)


def _carried(plant: Plant, joint: str) -> list[str]:
    """Names of the bodies that a joint moves."""
    model = plant.model
    own = int(model.jnt_bodyid[model.joint(joint).id])
    found = []
    for name in plant.bodies:
        body = model.body(name).id
        while body and body != own:
            body = int(model.body_parentid[body])
        if body == own:
            found.append(name)
    return found
