"""The diagnosis from end to end: what the model lacks, how much of it, how sure, and what is left."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import monotonic
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from bumblebee.diagnosis.budget import Budget
from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.comparison import Holdout, simulated_without, standing, withdrawn
from bumblebee.diagnosis.config import DiagnosisConfig
from bumblebee.diagnosis.dataset import Session
from bumblebee.diagnosis.discrepancy import (
    Discovery,
    JointActivity,
    discover,
    lack_of_fit,
    offers_of,
    with_catalogue_effects,
)
from bumblebee.diagnosis.estimation import gauss_newton
from bumblebee.diagnosis.prepare import Material, gather
from bumblebee.diagnosis.report import (
    Findings,
    before_and_after,
    document,
    effect_entries,
    errors_of,
    harms,
    law_notes,
    loss_entries,
    shares_left_out,
    surface_notes,
    unseen_notes,
)
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.diagnosis.selection import (
    Refined,
    Search,
    grids,
    half_widths,
    least_simulation_error,
    refine,
    search,
    with_other_laws,
)
from bumblebee.diagnosis.selection import entries as rounding_entries
from bumblebee.diagnosis.simulation import OutOfTime, Stop, ending
from bumblebee.sim.effects import Effect


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The outcome: the contract's document, the effects as values, and what the report draws from."""

    document: dict[str, Any]
    effects: list[Effect]
    session: Session
    search: Search
    problem: Problem


@dataclass(frozen=True, eq=False)
class _Found:
    """Outcome of search, last fit and the look beyond the catalogue."""

    search: Search
    last: Refined
    holdout: Holdout
    """Around the last fit."""
    beyond: Discovery | None
    budgets: tuple[Budget, ...]
    """Budgets of the search and of the look beyond the catalogue, with what they left out."""

    @property
    def judging(self) -> Problem:
        """Windows that took no part in the fit; the fitted ones where there are none."""
        return self.holdout.problem or self.last.problem


def diagnose(
    session: Session,
    config: DiagnosisConfig | None = None,
    say: Callable[[str], None] = lambda text: None,
    stop: Stop | None = None,
) -> Diagnosis:
    """Find the effects that the declared model of `session` lacks.

    Where `stop` ends the searches early, what they have found by then is fitted and reported.

    Linear algebra takes one thread meanwhile: its matrices have some hundred rows, and a Cholesky factor of 580 that
    took 1.3 ms on one thread took 54 ms on two of a busy machine.
    """
    with threadpool_limits(1, user_api="blas"):
        return _diagnose(session, config or DiagnosisConfig(), say, stop or Stop())


def _diagnose(session: Session, config: DiagnosisConfig, say: Callable[[str], None], stop: Stop) -> Diagnosis:
    """Diagnose on the threads that there are."""
    rng = np.random.default_rng(config.seed)
    began = monotonic()
    material = gather(session, config, rng, say)
    stop.opened = monotonic() - began
    found = _found(material, config, rng, say, stop)
    say(f"prediction error before and after {len(found.last.fit.chosen)} effects")
    shares = partial(shares_left_out, material.session, config.report_windows)
    entries = effect_entries(found.search, found.last, found.holdout, found.beyond, shares)
    rounded, steps = _steps_of_encoders(material.session, found)
    lost, losses = loss_entries(found.search.loss)
    effects, steps, notes = standing(found.judging, found.last.fit.effects, steps)
    if found.last.fit.chosen and not effects:
        found, entries = _nothing(material, found), []
    beside = Findings([*steps, *losses], [*(rounded if steps else []), *lost], notes)
    effects = [*effects, *beside.effects]
    told = _told(material, config, found, Findings(effects, [*entries, *beside.entries], notes))
    if effects and material.session.holdout and harms(told["summary"]["removed"]):
        found, told, effects = _harmless(material, config, found, effects, beside, told)
    return Diagnosis(told, effects, material.session, found.search, found.last.problem)


def _harmless(
    material: Material,
    config: DiagnosisConfig,
    found: _Found,
    effects: Sequence[Effect],
    beside: Findings,
    told: dict[str, Any],
) -> tuple[_Found, dict[str, Any], list[Effect]]:
    """Withdraw one effect after the other until the rest does no harm on held-out rollouts; all where that never is.

    First goes that without which they err least: those that judge choose, too, and the note says so. On the robot where
    validation rollouts were asked instead, what did the harm would have gone last (docs/results/method.md).

    Args:
        material: the data.
        config: settings.
        found: what was found.
        effects: all of it, as values.
        beside: what was not fitted but read off the logs, and the notes.
        told: the document with all effects, which do harm.

    Returns:
        What is left of it, its document, its effects.
    """
    errors, session, fit = before_and_after(told["summary"]["removed"]), material.session, found.last.fit

    def stands(rest: _Found, left: list[Effect], entries: list[dict[str, Any]]) -> dict[str, Any]:
        gone = withdrawn([effect for effect in effects if effect not in left], "held-out rollouts")
        chosen = ["the rest was chosen by these rollouts: judge it by new ones"] if left else []
        note = "; ".join([gone, errors, *chosen])
        return _told(material, config, rest, Findings(left, entries, [*beside.notes, note]))

    shares = partial(shares_left_out, session, config.report_windows)
    less = [fit.without([candidate]).effects for candidate in fit.chosen]
    order = np.argsort(errors_of(session, session.holdout, config.report_windows, less), kind="stable")
    for count in range(1, len(order)):
        rest = _without(material, found, [fit.chosen[i] for i in order[:count]])
        left = [*rest.last.fit.effects, *beside.effects]
        entries = effect_entries(rest.search, rest.last, rest.holdout, rest.beyond, shares)
        told = stands(rest, left, [*entries, *beside.entries])
        if not harms(told["summary"]["removed"]):
            return rest, told, left
    nothing = _nothing(material, found)
    return nothing, stands(nothing, [], []), []


def _told(material: Material, config: DiagnosisConfig, found: _Found, findings: Findings) -> dict[str, Any]:
    """The document of what stands, with the notes on how it was found."""
    gone = [] if found.beyond is None else found.beyond.withdrawn
    notes = [
        *(f"replaced by a discrepancy model or effect that explains more: {name}" for name in gone),
        *findings.notes,
        *law_notes(found.last),
        *(n for b in found.budgets for n in b.notes()),
        *surface_notes(material.session, findings.effects, config.thresholds.report.verdicts),
        *unseen_notes(material.session, findings.effects, config.horizon, config.thresholds.report.verdicts),
    ]
    whole = Findings(findings.effects, findings.entries, notes)
    return document(material, config, found.search, found.last, found.beyond, whole)


def _found(
    material: Material, config: DiagnosisConfig, rng: np.random.Generator, say: Callable[[str], None], stop: Stop
) -> _Found:
    """The effects of the catalogue, then what lies beyond it."""
    larger = max(1.0, material.session.plant.model.nv / max(1, material.session.thresholds.time_steps.small_model))
    stop.searching = True
    time = Budget(larger * config.search_seconds, "among the catalogue's effects", "search_seconds", over=stop.over)
    found = search(material.problem, material.holdout, material.remade, config.search, say, time)
    say(f"final fit of {len(found.fit.chosen)} effects")
    holdout = material.holdout.finely()
    last = refine(found.problem, found.fit, rng, holdout)
    if last.fit.chosen:
        holdout = holdout.relinearised(last.fit.effects)
    if not config.beyond:
        return _Found(found, _finished(last, holdout, found, stop), holdout, None, (time,))
    say("testing the residual")
    budget = Budget(larger * config.beyond_seconds, over=stop.over, found=lambda: len(last.fit.chosen))
    offers = offers_of(found, material.candidates)
    activity = JointActivity(material.typical, material.still)

    def tested() -> Discovery:
        left = lack_of_fit(last.problem, holdout.problem, last.fit, activity)
        return Discovery(last.problem, holdout, last.fit, left, {}, {}, [])

    look = partial(discover, last.problem, holdout, last.fit, activity, say, offers, budget)
    try:
        with ending(budget.ends):
            beyond = material.session.plant.failures.attempt("model discrepancy", look, tested)
    except OutOfTime:
        budget.has_time_for("discrepancy models")
        beyond = tested()
    last = _finished(_with(beyond, last), beyond.holdout, found, stop)
    return _Found(with_catalogue_effects(found, last.fit), last, beyond.holdout, beyond, (time, budget))


def _finished(last: Refined, holdout: Holdout, found: Search, stop: Stop) -> Refined:
    """The last fit at the values of least simulation error, with other laws that fit as well.

    What cannot be computed, or has no time left, is left out.
    """
    attempt, moved = last.problem.plant.failures.attempt, last
    every = found.columns.candidates
    try:
        with ending(partial(stop.over, len(last.fit.chosen))):
            moved = attempt("least simulation error", lambda: least_simulation_error(last, holdout), lambda: last)
            return attempt("laws of hysteresis", lambda: with_other_laws(moved, holdout, every), lambda: moved)
    except OutOfTime:
        return moved


def _steps_of_encoders(session: Session, found: _Found) -> tuple[list[dict[str, Any]], list[Effect]]:
    """Entries and effects of the encoders' steps that the logs show."""
    rule = found.judging.thresholds.selection.proposals.encoder_resolution
    readings = grids(session.rollouts, session.sigma[: len(session.plant.joints)], rule)
    return rounding_entries(readings, found.judging, found.last.fit)


def _without(material: Material, found: _Found, gone: Sequence[Candidate]) -> _Found:
    """The other effects where they are, in the place of all."""
    problem = found.last.problem
    fit = simulated_without(problem, found.last.fit, gone)
    weights = window_weights(fit.clean(problem))
    laws = {candidate: law for candidate, law in found.last.other_laws.items() if candidate not in gone}
    last = Refined(problem, fit, weights, half_widths(problem, fit, weights), laws)
    holdout, beyond = found.holdout.relinearised(fit.effects), found.beyond
    if beyond is not None:
        activity = JointActivity(material.typical, material.still)
        left = lack_of_fit(problem, holdout.problem, fit, activity)
        beyond = replace(beyond, problem=problem, holdout=holdout, fit=fit, left=left)
    return replace(found, last=last, holdout=holdout, beyond=beyond)


def _nothing(material: Material, found: _Found) -> _Found:
    """The declared model in the place of a fit that may not stand, and what it leaves."""
    problem, holdout = found.search.problem.finely().relinearised([]), material.holdout.finely()
    weights = window_weights(problem.residual([[]])[0])
    last = Refined(problem, gauss_newton(problem, (), (), weights), weights, np.empty(0))
    beyond = None
    if found.beyond is not None:
        activity = JointActivity(material.typical, material.still)
        left = lack_of_fit(problem, holdout.problem, last.fit, activity)
        beyond = Discovery(problem, holdout, last.fit, left, {}, {}, [])
    return replace(found, last=last, holdout=holdout, beyond=beyond)


def _with(beyond: Discovery, last: Refined) -> Refined:
    """The fit with what was discovered and its intervals; the last one where nothing was."""
    if beyond.fit.chosen == last.fit.chosen:
        return last
    weights = window_weights(beyond.fit.clean(beyond.problem))
    return Refined(beyond.problem, beyond.fit, weights, half_widths(beyond.problem, beyond.fit, weights))
