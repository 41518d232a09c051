"""The candidates that explain most when each is taken alone: a first look, no search."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.comparison import Holdout, drop_unsure, walds
from bumblebee.diagnosis.config import SearchConfig
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.diagnosis.selection.moves import Terms, refitted
from bumblebee.diagnosis.selection.proposals.all_joints import (
    all_joints_of,
    is_fixed,
    is_nearer,
    not_simulated,
    standard_parameters,
)
from bumblebee.diagnosis.selection.rounds import SINGLE, Kept, Round, ask
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.steps import go
from bumblebee.diagnosis.selection.trial import Trial
from bumblebee.sim.effects import Effect


@dataclass(frozen=True, eq=False)
class Lead:
    """One candidate, fitted alone, or one of the standard parameters that are far off together."""

    candidate: Candidate
    values: np.ndarray
    """(P,) parameters."""
    z: float
    """Standard errors from the declared value."""
    explains: float
    """Share of the chi-square above the noise that goes with it, on windows that took no part where there are any."""


@dataclass(frozen=True, eq=False)
class Leads:
    """Findings of a first look."""

    together: list[Lead]
    """Standard parameters, found at once by inverse dynamics; each explains what all do."""
    alone: list[Lead]
    """Single effects where there are none of these, the best first."""


def leads(
    problem: Problem,
    holdout: Holdout,
    remake: Callable[[Sequence[Effect]], tuple[list[Candidate], np.ndarray]],
    config: SearchConfig,
    say: Callable[[str], None],
    count: int,
    quiet: Collection[str] = (),
) -> Leads:
    """Standard parameters where these are far off, else the `count` candidates whose trials cost least.

    None of these on the joints `quiet`, whose residual shows nothing. An effect in one place is one lead, by the
    candidate whose trial costs least, however many of its parameters are tested together.
    """
    run, attempt = SearchState(problem, holdout, remake, config, say), problem.plant.failures.attempt

    def shown(effects: Sequence[Effect]) -> tuple[list[Candidate], np.ndarray]:
        candidates, typical = remake(effects)
        return [c for c in candidates if c.where not in quiet], typical

    run.remake = shown
    run.open()
    now = Round(run)
    ask(now, SINGLE, Kept())
    tried = now.tried if now.looked else [*now.tried, *run.trials()[0]]
    standard = attempt("standard parameters", lambda: _standard(run, tried), lambda: None)
    if standard is not None:
        return Leads(_together(run, standard), [])
    found = []
    cheapest: dict[tuple[str, str], Trial] = {}
    for trial in sorted(tried, key=lambda t: t.cost):
        cheapest.setdefault((trial.candidate.effect, trial.candidate.where), trial)
    for trial in list(cheapest.values())[:count]:
        start = np.concatenate((run.fit.values, trial.values))
        move = refitted(run.now, run.fit, trial.candidate, [start], Terms(run.bound, (), iterations=2))
        if move is not None:
            share = _explains(run, run.fit, move.after)
            found.append(Lead(trial.candidate, move.after.of(trial.candidate), move.z, share))
    return Leads([], sorted(found, key=lambda lead: -lead.explains))


def _standard(run: SearchState, tried: Sequence[Trial]) -> Fit | None:
    """Standard parameters of a robot whose model is far off, if no trial comes near; only sure ones.

    On a free base as inverse dynamics say them: to fit them in the simulator takes a minute or two.
    """
    if run.power() < run.config.far:
        return None
    fit = go(run, all_joints_of) if is_fixed(run.problem) else _not_simulated(run)
    if fit is None or not is_nearer(run, fit, tried):
        return None
    return drop_unsure(run.problem, fit, window_weights(fit.clean(run.problem)))


def _not_simulated(run: SearchState) -> Fit | None:
    begun = standard_parameters(run.problem, run.candidates, run.config.level)
    return not_simulated(run.problem, begun) if begun else None


def _together(run: SearchState, fit: Fit) -> list[Lead]:
    """Effects that were found at once, joint by joint."""
    share = _explains(run, run.fit, fit)
    sizes = walds(run.problem, fit, window_weights(fit.clean(run.problem)), fit.chosen)
    return [Lead(c, fit.of(c), float(z), share) for c, z in zip(fit.chosen, sizes, strict=True)]


def _explains(run: SearchState, before: Fit, after: Fit) -> float:
    """Share of the mean square above 1 that goes from one fit to another; by the median of the windows."""
    judged = run.holdout.problem is not None
    old, new = run.holdout.left([before, after]) if judged else (f.clean(run.problem) for f in (before, after))
    power = [float(np.median((r**2).mean(axis=1))) for r in (old, new)]
    return float(np.clip((power[0] - power[1]) / max(power[0] - 1.0, 1e-12), 0.0, 1.0))
