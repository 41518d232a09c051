"""Beyond the catalogue: what remains after the best fit, its form, and that form refitted in the simulator.

A law is found in the whitened windows (`diagnosis/seek.py`), with and without the catalogue's effects on its joint: a
strange effect is often half explained by a name that it has not. Its terms then join the fit like any other effect,
and what they make needless is dropped. The form is kept if the windows that took no part in the fit are better with it
by more than two standard errors, and if it explains most of what the joint lacked. What is not kept is described, never
forced into a name.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bumblebee.diagnosis.acceptance import wald
from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.fit import Fit, cost_of, gauss_newton, resolved
from bumblebee.diagnosis.formula import DISCOVERED, Formula, formula, in_terms, related, stiffer_than_the_drive
from bumblebee.diagnosis.holdout import Holdout
from bumblebee.diagnosis.laws import beside, joined
from bumblebee.diagnosis.problem import Problem, window_weights
from bumblebee.diagnosis.remains import Remains, remains
from bumblebee.diagnosis.scene import fitted_scene
from bumblebee.diagnosis.seek import Found, library, seek

_JOINTS = 3  # joints at most that get a form
_MANY = 8  # effects in a fit beyond which one joint does, and inner numbers stay as found: every trial refits them all
_SURE = 4.0  # z below which an effect beside a form is needless
_Z, _LEAST = 2.0, 0.01  # of the judging windows' gain, and its least share
_MOST = 0.5  # share of a joint's excess that may remain where its form was found
_PARAMETER = 4.0  # log-likelihood that a parameter must bring
_LAWS, _WORTH, _SHARE = 3, 12.0, 0.03  # laws in a form; what a further one must bring, and as a share of the first's
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
    """Effects of the catalogue that a form made needless."""


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
) -> Discovery:
    """Test, name and refit what `fit` leaves; arguments as of `remains`."""
    left = remains(problem, holdout.problem, fit, typical, still)
    tried: list[str] = []
    unconfirmed: dict[str, dict[str, float]] = {}
    kinds: dict[str, str] = {}
    before = fit
    while len(tried) < (_JOINTS if len(fit.chosen) <= _MANY else 1):
        worst = left.worst(tried)
        if worst is None:
            break
        tried.append(worst.joint)
        form = _best_form(problem, fit, left, worst.joint, typical)
        if form is None:
            continue
        if not holdout.gains(fit, form.fit, _Z, _LEAST):
            unconfirmed[worst.joint] = form.terms
            continue
        moved = problem.relinearised(form.fit.effects)
        new = resolved(moved, form.fit, window_weights(form.fit.clean(moved)))
        judged = holdout.relinearised(new.effects)
        rest = remains(moved, judged.problem, new, typical, still)
        column = problem.plant.joints.index(worst.joint)
        if rest.joints[column].excess > max(_MOST * worst.excess, 2.0):
            unconfirmed[worst.joint] = form.terms
            continue
        say(f"discovered on {worst.joint}: {' + '.join(f'{v:.3g} {t}' for t, v in form.terms.items())[:100]}")
        problem, holdout, fit, left, kinds[worst.joint] = moved, judged, new, rest, form.kind
    gone = [c for c in before.chosen if c not in fit.chosen]
    names = [f"{c.effect} on {c.where or 'the whole robot'}" for c in gone]
    return Discovery(problem, holdout, fit, left, unconfirmed, kinds, names)


def _best_form(problem: Problem, fit: Fit, left: Remains, joint: str, typical: np.ndarray) -> _Form | None:
    """The form that explains the fitted windows best for its parameters; None where no strange law was found."""
    column = problem.plant.joints.index(joint)
    ways: list[tuple[Fit, list[Found]]] = [(fit, [f for f in left.sought.found if f.joint == column])]
    ways += [(fit, [rival]) for rival in left.sought.rivals if rival.joint == column]
    own = [c for c in fit.chosen if c.where == joint]
    if own:
        bare = _less(problem, fit, own)
        scene = fitted_scene(problem, bare, typical)
        some = library(scene.data, [column])
        sought = seek(problem, scene.evidence, scene.residual, scene.columns, some, most=_LAWS)
        ways += [(bare, sought.found), (fit, sought.found), *((bare, [rival]) for rival in sought.rivals)]
    forms = [_growing(problem, base, joint, found) for base, found in ways]
    return max((f for f in forms if f is not None), key=lambda f: f.score, default=None)


def _growing(problem: Problem, base: Fit, joint: str, found: Sequence[Found]) -> _Form | None:
    """The form of as many of the laws as are worth it, in the order in which they were found."""
    there = {c.effect for c in base.chosen if c.where == joint}
    strange = [f for f in found if not f.law.known or f.law.known in there]
    best, start = None, _score(base.clean(problem), len(base.values))
    for count in range(1, min(len(strange), _LAWS) + 1):
        form = _form(problem, base, joint, strange[:count])
        if form is None:
            break
        if count == 1 and len(base.chosen) <= _MANY:
            form = _climbed(problem, base, joint, strange[0], form)
        if best is not None and form.score - best.score < max(_WORTH, _SHARE * (best.score - start)):
            break
        best = form
    return best


def _climbed(problem: Problem, base: Fit, joint: str, one: Found, form: _Form) -> _Form:
    """The form at the best of the law's two inner numbers, from neighbour to neighbour."""
    seen, law = {one.law.texts}, one.law
    while True:
        tried = {}
        for other in beside(law):
            if other.texts not in seen:
                seen.add(other.texts)
                tried[other] = _form(problem, base, joint, [replace(one, law=other)])
        best = max((f for f in tried.values() if f is not None), key=lambda f: f.score, default=None)
        if best is None or best.score < form.score + _PARAMETER:
            return form
        law, form = next(other for other, f in tried.items() if f is best), best


def _score(left: np.ndarray, parameters: int) -> float:
    """Log-likelihood of whitened windows (W, M) with long tails, less what the parameters cost."""
    return -0.5 * left.shape[1] * float(np.log1p((left**2).mean(axis=1)).sum()) - _PARAMETER * parameters


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
            chosen, values = _without(chosen, values, c)
            terms = parts | terms
    own = formula(joint, terms)
    fit = _refitted(problem, (*chosen, own), np.concatenate((values, list(terms.values()))))
    fit = _pruned(problem, fit, own)
    if own not in fit.chosen or stiffer_than_the_drive(problem.plant, own, fit.of(own)):
        return None
    score = _score(fit.clean(problem), len(fit.values))
    return _Form(fit, score, kind, dict(zip(own.texts, map(float, fit.of(own)), strict=True)))


def _refitted(problem: Problem, chosen: Sequence[Candidate], values: np.ndarray) -> Fit:
    """All effects at their best, windows weighed as the first trial leaves them."""
    start = gauss_newton(problem, chosen, values, np.ones(len(problem.windows)), iterations=0)
    return gauss_newton(problem, chosen, values, window_weights(start.clean(problem)), iterations=3, coarse=True)


def _pruned(problem: Problem, fit: Fit, form: Formula) -> Fit:
    """Less the effects of the catalogue that the form has made needless, the least sure first."""
    while True:
        weights = window_weights(fit.clean(problem))
        z = [np.inf if c is form else wald(problem, fit, weights, i) for i, c in enumerate(fit.chosen)]
        worst = int(np.argmin(z))
        if z[worst] >= _SURE:
            return fit
        chosen, values = _without(fit.chosen, fit.values, fit.chosen[worst])
        fit = gauss_newton(problem, chosen, values, weights, iterations=2, coarse=True)


def _without(
    chosen: Sequence[Candidate], values: np.ndarray, gone: Candidate
) -> tuple[tuple[Candidate, ...], np.ndarray]:
    """The chosen effects and their values less one."""
    keep, at = [], 0
    for c in chosen:
        if c is not gone:
            keep += list(range(at, at + len(c.nominal)))
        at += len(c.nominal)
    return tuple(c for c in chosen if c is not gone), values[keep]


def _less(problem: Problem, fit: Fit, gone: Sequence[Candidate]) -> Fit:
    """The fit less some effects, the others where they are."""
    chosen, values = fit.chosen, fit.values
    for c in gone:
        chosen, values = _without(chosen, values, c)
    ones = np.ones(len(problem.windows))
    bare = gauss_newton(problem, chosen, values, ones, iterations=0)
    weights = window_weights(bare.clean(problem))
    return replace(bare, nuisance=cost_of(problem, bare.residual, weights)[1])


def is_discovered(candidate: Candidate) -> bool:
    """Whether it is a form and not an effect of the catalogue."""
    return candidate.effect == DISCOVERED
