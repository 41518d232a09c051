"""The diagnosis from end to end: what the model lacks, how much of it, how sure, and what is left."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bumblebee.diagnosis.arrivals import loss_entries
from bumblebee.diagnosis.beyond import NOT_TESTED, structure_table, unexplained
from bumblebee.diagnosis.candidates import Candidate, all_candidates, scales_of, still_joints
from bumblebee.diagnosis.classes import detectable
from bumblebee.diagnosis.discover import Discovery, discover
from bumblebee.diagnosis.entries import effect_entries
from bumblebee.diagnosis.error_block import error_block, floor_block, horizon_whiteners, horizon_windows
from bumblebee.diagnosis.fit import interval
from bumblebee.diagnosis.guard import standing
from bumblebee.diagnosis.holdout import Holdout
from bumblebee.diagnosis.instead import offers_of, with_named
from bumblebee.diagnosis.latency import latency_notes
from bumblebee.diagnosis.nuisance import NAMES
from bumblebee.diagnosis.problem import Problem, make_problem, window_weights
from bumblebee.diagnosis.quantised import entries, grids
from bumblebee.diagnosis.refine import Refined, refine
from bumblebee.diagnosis.roles import informative
from bumblebee.diagnosis.search import Search, SearchConfig, search
from bumblebee.diagnosis.session import Session
from bumblebee.diagnosis.variation import vary
from bumblebee.diagnosis.windows import choose_starts, cut
from bumblebee.errors import BadInput
from bumblebee.sim.effects import Effect

_LONG = 1.0  # [s]
_MORE = 2.5  # times as many windows for the smallest models


@dataclass(frozen=True)
class DiagnosisConfig:
    """How much work a diagnosis does."""

    horizon: float = 0.2
    """Length of the windows that effects are attributed on [s]."""
    max_windows: int = 120
    """Windows that take part in the fit."""
    max_holdout_windows: int = 60
    """Held-out windows that acceptance is decided on."""
    report_windows: int = 80
    """Windows for each horizon of the error block."""
    max_long_windows: int = 20
    """Windows of 1 s on which an accepted effect must not be worse."""
    grow: bool = True
    """Whether models of few degrees of freedom, which are cheap, get more windows."""
    seed: int = 0
    beyond: bool = True
    """Whether to look for structure that no effect of the catalogue explains, and for its form."""
    search: SearchConfig = field(default_factory=SearchConfig)
    """How strict the search is."""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The outcome: the contract's document, the effects as values, and what the report draws from."""

    document: dict[str, Any]
    effects: list[Effect]
    session: Session
    search: Search
    problem: Problem


def diagnose(
    session: Session, config: DiagnosisConfig | None = None, say: Callable[[str], None] = lambda text: None
) -> Diagnosis:
    """Find the effects that the declared model of `session` lacks."""
    config = config or DiagnosisConfig()
    rng = np.random.default_rng(config.seed)
    still = still_joints(session.plant, session.rollouts, session.sigma)
    candidates = all_candidates(session.plant, session.rollouts, still)
    session = informative(session, config.horizon)
    fitted = [i for i in session.train if i not in session.accept]
    say(
        f"{len(fitted)} rollouts to fit, {len(session.accept)} to accept by, {len(session.holdout)} held out, "
        f"{len(candidates)} candidates"
    )
    # A small model costs little to simulate: more windows.
    more = float(np.clip(12 / session.plant.model.nv, 1.0, _MORE)) if config.grow else 1.0
    say("what noise in the starts becomes, by simulation")
    problem = _problem(session, fitted, round(more * config.max_windows), config.horizon, rng)
    holdout = _holdout(session, config, more, rng)
    say(f"{len(problem.windows)} windows of {config.horizon:g} s")

    def remake(effects: Sequence[Effect]) -> tuple[list[Candidate], np.ndarray]:
        varied = vary(session.plant, effects)
        model = varied.model if varied.plant is None else None
        made = all_candidates(session.plant, session.rollouts, still, model)
        return made, scales_of(session.plant, session.rollouts, model).torque

    found = search(problem, holdout, remake, config.search, say)
    last = refine(found.problem, found.fit, rng, holdout)
    if last.fit.chosen:
        holdout = holdout.relinearised(last.fit.effects)
    document: dict[str, Any] = {"schema": 1, "train": session.ids(session.train)}
    document |= {"holdout": session.ids(session.holdout), "accept": session.ids(session.accept)}
    beyond = None
    if config.beyond:
        say("what is left")
        typical = scales_of(session.plant, session.rollouts).torque
        beyond = discover(last.problem, holdout, last.fit, typical, still, say, offers_of(found, candidates))
        last, holdout = _with(beyond, last), beyond.holdout
        found = with_named(found, last.fit)
    say(f"{len(last.fit.chosen)} effects; error before and after")
    document["effects"] = effect_entries(found, last, holdout, beyond)
    effects = last.fit.effects
    document["unexplained"] = NOT_TESTED if beyond is None else unexplained(beyond)
    if beyond is not None:
        document["structure"] = structure_table(beyond)
        session.notes.extend(f"withdrawn for what explains more: {name}" for name in beyond.withdrawn)
    readings = grids(session.rollouts, session.sigma[: len(session.plant.joints)])
    judging = holdout.problem or last.problem
    rounded, steps = entries(readings, judging, last.fit)
    lost, losses = loss_entries(found.loss)
    effects, steps, withdrawn = standing(judging, effects, steps)
    session.notes.extend(withdrawn)
    named = (document["effects"] if effects else []) + (rounded if steps else [])
    effects, document["effects"] = [*effects, *steps, *losses], named + lost
    document["error"] = _errors(session, effects, config)
    document["unidentifiable"] = [
        {"where": [name], "why": "the joint moves no more than its sensor's noise"} for name in still
    ]
    document["smallest_detectable"] = detectable(found)
    document["set_aside"] = session.set_aside
    document["notes"] = session.notes + latency_notes(document["effects"], _driven(session))
    document["settings"] = _settings(session, config, len(problem.windows), len(candidates), found.bound, last)
    return Diagnosis(document, effects, session, found, last.problem)


def _settings(
    session: Session, config: DiagnosisConfig, windows: int, candidates: int, bound: float, last: Refined
) -> dict[str, Any]:
    """What the diagnosis was made with."""
    return {
        "timestep": session.steps[0],
        "windows": windows,
        "horizon": config.horizon,
        "seed": config.seed,
        "candidates": candidates,
        "bound": bound,
        "numerics": dict(zip(NAMES, last.fit.nuisance.tolist(), strict=False)),
        "noise": dict(zip(session.layout.labels(session.plant.joints), session.sigma.tolist(), strict=True)),
    }


def _driven(session: Session) -> list[str]:
    """Names of the joints with an actuator."""
    return [name for name, a in zip(session.plant.joints, session.plant.actuator, strict=True) if a >= 0]


def _holdout(session: Session, config: DiagnosisConfig, more: float, rng: np.random.Generator) -> Holdout:
    """Windows of 0.2 s and of 1 s of the rollouts that acceptance is decided on."""
    if not session.accept:
        return Holdout()
    problem = _problem(session, session.accept, round(more * config.max_holdout_windows), config.horizon, rng)
    starts = choose_starts(session.rollouts, session.accept, _LONG, config.max_long_windows)
    long = cut(session.plant, session.layout, session.rollouts, starts, outputs=1) if starts else None
    return Holdout(problem, long)


def _problem(session: Session, ids: Sequence[int], budget: int, horizon: float, rng: np.random.Generator) -> Problem:
    starts = choose_starts(session.rollouts, ids, horizon, budget)
    if not starts:
        names = ", ".join(session.ids(ids)[:3])
        raise BadInput(f"rollouts {names}", f"stretches of {horizon:g} s", "shorter ones", "Record longer runs.")
    windows = cut(session.plant, session.layout, session.rollouts, starts)
    return make_problem(session.plant, session.layout, windows, session.sigma, session.steps, [], rng)


def _with(beyond: Discovery, last: Refined) -> Refined:
    """The fit with what was discovered and its intervals; the last one where nothing was."""
    if beyond.fit.chosen == last.fit.chosen:
        return last
    weights = window_weights(beyond.fit.clean(beyond.problem))
    return Refined(beyond.problem, beyond.fit, weights, interval(beyond.problem, beyond.fit, weights))


def _errors(session: Session, effects: Sequence[Effect], config: DiagnosisConfig) -> dict[str, Any]:
    ids = session.holdout or session.train
    windows = horizon_windows(session.plant, session.layout, session.rollouts, ids, config.report_windows)
    before, after = vary(session.plant, []), vary(session.plant, effects)
    common = (session.plant, session.layout, windows)
    whiteners = horizon_whiteners(*common, after, session.sigma, session.steps[1], config.seed)
    fine = session.steps[0]
    return {
        "before": error_block(*common, whiteners, before, fine, config.seed),
        "after": error_block(*common, whiteners, after, fine, config.seed),
        "floor": floor_block(*common, whiteners, session.sigma, config.seed),
    }
