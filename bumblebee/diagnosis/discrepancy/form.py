"""The discrepancy model of a joint: basis functions found in its windows, refitted in the simulator with all else."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bumblebee.diagnosis.budget import Budget
from bumblebee.diagnosis.candidates import formula, short_term
from bumblebee.diagnosis.comparison import criterion, drop_beside, refitted, simulated_without
from bumblebee.diagnosis.discrepancy.catalogue_terms import in_terms, related, stiffer_than_the_drive
from bumblebee.diagnosis.discrepancy.missing_torque import fitted_scene
from bumblebee.diagnosis.discrepancy.residual_tests import LackOfFit
from bumblebee.diagnosis.discrepancy.stepwise_regression import Found, library, seek
from bumblebee.diagnosis.discrepancy.term_library import joined, neighbours
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.residuals import Problem


@dataclass(frozen=True, eq=False)
class DiscrepancyModel:
    """One way to explain a joint."""

    fit: Fit
    score: float
    kind: str
    """"formula" or "curve"."""
    terms: dict[str, float]

    def __str__(self) -> str:
        """The discrepancy model in a line."""
        return short_term(" + ".join(f"{v:.3g} {t}" for t, v in self.terms.items()), 100)


@dataclass(frozen=True, eq=False)
class _Refits:
    """Refits of models of one joint: on what, within what, and who is told of each."""

    problem: Problem
    joint: str
    budget: Budget
    say: Callable[[str], None]

    def tell(self, text: str) -> None:
        """A line of progress."""
        self.say(f"discrepancy model of {self.joint}: {text}")


def best_model(
    problem: Problem,
    fit: Fit,
    left: LackOfFit,
    joint: str,
    budget: Budget,
    say: Callable[[str], None] = lambda text: None,
) -> DiscrepancyModel | None:
    """The one that explains the fitted windows best for its parameters; None where no strange function was found.

    Args:
        problem: the fitted windows.
        fit: of the effects found so far.
        left: what it leaves.
        joint: name of the joint.
        budget: of time; what there is none for is left out and written down there.
        say: told of progress.
    """
    refits = _Refits(problem, joint, budget, say)
    column, rule = problem.plant.joints.index(joint), problem.thresholds.discrepancy.form
    ways: list[tuple[Fit, list[Found]]] = [(fit, [f for f in left.sought.found if f.joint == column])]
    ways += [(fit, [rival]) for rival in left.sought.rivals if rival.joint == column]
    own = [c for c in fit.chosen if c.where == joint]
    if own:
        refits.tell(f"basis functions without {', '.join(c.effect for c in own)}")
        bare = simulated_without(problem, fit, own)
        scene = fitted_scene(problem, bare, left.scene.torque, [column])
        some = library(scene.data, [column])
        sought = seek(problem, scene.evidence, scene.residual, scene.columns, some, most=rule.functions)
        ways += [(bare, sought.found), (fit, sought.found), *((bare, [rival]) for rival in sought.rivals)]
    models = [_growing(refits, base, found) for base, found in ways]
    return max((f for f in models if f is not None), key=lambda f: f.score, default=None)


def _growing(refits: _Refits, base: Fit, found: Sequence[Found]) -> DiscrepancyModel | None:
    """That of as many of the basis functions as are worth it, in the order in which they were found."""
    problem, joint = refits.problem, refits.joint
    rule = problem.thresholds.discrepancy.form
    there = {c.effect for c in base.chosen if c.where == joint}
    strange = [f for f in found if not f.function.effect or f.function.effect in there]
    best, start = None, criterion(problem, base)
    for count in range(1, min(len(strange), rule.functions) + 1):
        if not refits.budget.has_time_for(f"all discrepancy models of {joint}"):
            break
        refits.tell(f"refit with {short_texts(strange[:count])}")
        model = refitted_model(problem, base, joint, strange[:count])
        if model is None:
            break
        if count == 1 and len(base.chosen) <= rule.many_effects:
            model = _climbed(refits, base, strange[0], model)
        if best is not None and model.score - best.score < max(rule.worth, rule.worth_share * (best.score - start)):
            break
        best = model
    return best


def _climbed(refits: _Refits, base: Fit, one: Found, model: DiscrepancyModel) -> DiscrepancyModel:
    """The discrepancy model at the best of the basis function's two inner numbers, from neighbour to neighbour."""
    problem, joint = refits.problem, refits.joint
    rule = problem.thresholds.discrepancy.term_library
    seen, function = {one.function.texts}, one.function
    while refits.budget.has_time_for(f"the nonlinear parameters of a model of {joint}"):
        tried = {}
        for other in neighbours(function, rule):
            if other.texts not in seen:
                seen.add(other.texts)
                refits.tell(f"refit with {short_texts([replace(one, function=other)])}")
                tried[other] = refitted_model(problem, base, joint, [replace(one, function=other)])
        best = max((f for f in tried.values() if f is not None), key=lambda f: f.score, default=None)
        if best is None or best.score < model.score + problem.thresholds.comparison.criterion.parameter:
            return model
        function, model = next(other for other, f in tried.items() if f is best), best
    return model


def short_texts(found: Sequence[Found]) -> str:
    """The terms of basis functions, a curve as one, each cut to what a line of progress holds."""
    texts = [text for one in found for text in joined(list(one.function.texts), one.verdict.size)[0]]
    return ", ".join(short_term(text, 40) for text in texts)


def refitted_model(problem: Problem, base: Fit, joint: str, strange: Sequence[Found]) -> DiscrepancyModel | None:
    """`base` with strange basis functions, refitted; effects that became needless are dropped."""
    rules = problem.thresholds.discrepancy
    terms: dict[str, float] = {}
    for one in strange:
        for text, size in zip(*joined(list(one.function.texts), one.verdict.size), strict=True):
            terms[text] = float(size)
    kind = "curve" if any(one.function.table for one in strange) else "formula"
    gone = []
    for c in [c for c in base.chosen if c.where == joint and related(list(terms), c.effect)]:
        parts = in_terms(problem.plant, base, c)
        if parts and max(map(abs, terms.values())) > rules.form.part * max(map(abs, parts.values())):
            gone.append(c)
            terms = parts | terms
    own = formula(joint, terms)
    rest = base.without(gone)
    fit = refitted(problem, (*rest.chosen, own), np.concatenate((rest.values, list(terms.values()))), base)
    fit = drop_beside(problem, fit, own)
    stiff = own in fit.chosen and stiffer_than_the_drive(problem.plant, own, fit.of(own), rules.catalogue_terms)
    if own not in fit.chosen or stiff:
        return None
    return DiscrepancyModel(
        fit, criterion(problem, fit), kind, dict(zip(own.texts, map(float, fit.of(own)), strict=True))
    )
