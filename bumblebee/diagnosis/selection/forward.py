"""Which effects: score tests of every candidate given those chosen, trials in the simulator, held-out gain, pruning.

A step that cannot be computed is left out and written down (`simulation.failures`); the search goes on without it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from bumblebee.diagnosis.budget import Budget
from bumblebee.diagnosis.candidates import JUDGED_ALONE, SATURATIONS, Candidate
from bumblebee.diagnosis.comparison import Holdout, Step
from bumblebee.diagnosis.config import SearchConfig
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.changes import Asking, Loss
from bumblebee.diagnosis.selection.proposals.all_joints import start_with_all_joints
from bumblebee.diagnosis.selection.proposals.declared_scale import keep_declared_scale
from bumblebee.diagnosis.selection.proposals.friction_family import complete_frictions
from bumblebee.diagnosis.selection.proposals.gain_parameters import merge_gain_parameters
from bumblebee.diagnosis.selection.proposals.leaning_sensor import whiten_where_it_leans
from bumblebee.diagnosis.selection.proposals.packet_loss import find_packet_loss
from bumblebee.diagnosis.selection.proposals.stribeck import add_dry_friction, add_stribeck_friction
from bumblebee.diagnosis.selection.rounds import ALL_JOINTS, PROPOSALS, Kept, Round, ask
from bumblebee.diagnosis.selection.score_tests import Scores
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.steps import go
from bumblebee.diagnosis.selection.swap import swap, swap_limits
from bumblebee.diagnosis.selection.trial import simplest
from bumblebee.diagnosis.sensitivities import Columns
from bumblebee.diagnosis.simulation import OutOfTime, ending
from bumblebee.sim.effects import Effect


@dataclass(eq=False)
class Search:
    """Outcome: the final fit and the way there."""

    fit: Fit
    problem: Problem
    """The fitted windows, their nuisances around the fit."""
    weights: np.ndarray
    steps: list[Step]
    screened: Problem
    """The windows that the columns are of."""
    columns: Columns
    """Screening columns of all candidates."""
    tests: Scores
    """Score tests of every candidate of `columns`, given the chosen ones."""
    bound: float
    """z that a candidate had to reach."""
    count: int
    """Candidates among which the false alarms are shared."""
    rejected: list[str] = field(default_factory=list)
    loss: Loss | None = None
    """Commands that never arrived; the windows then have those that did."""


def search(
    problem: Problem,
    holdout: Holdout,
    remake: Callable[[Sequence[Effect]], tuple[list[Candidate], np.ndarray]],
    config: SearchConfig,
    say: Callable[[str], None] = lambda text: None,
    budget: Budget | None = None,
) -> Search:
    """Forward selection with joint refits, then pruning.

    `remake` gives the candidates with steps for a model with some effects, and its joints' typical torques (J,) [N m].
    """
    budget = budget or Budget()
    run = begin(problem, holdout, remake, config, say, budget)
    _in_time(run, budget, "the step that was going on", partial(_steps, run, config, budget))
    steps = [s for s in run.steps if s.candidate in run.fit.chosen]
    return Search(
        run.fit,
        run.problem,
        run.weights,
        steps,
        run.small,
        run.columns,
        run.tests(),
        run.bound,
        len(run.candidates),
        run.rejected,
        run.loss,
    )


def _steps(run: SearchState, config: SearchConfig, budget: Budget) -> None:
    """All steps of a search that has begun."""
    attempt = run.problem.plant.failures.attempt
    _select(run, config, budget)
    if attempt("lost commands", partial(go, run, find_packet_loss), _no):
        _select(run, config, budget)
    for _ in range(run.rule.swaps):
        run.keep_whole()
        if not budget.has_time_for("swap steps"):
            break
        run.say("comparing each effect with its rivals")
        better = partial(_any_of, run, (swap, add_stribeck_friction, complete_frictions))
        if not attempt("swap steps", better, _no):
            break
        _select(run, config, budget)
    run.keep_whole()
    attempt("prune", run.prune, _no)
    for last in (keep_declared_scale, merge_gain_parameters, add_dry_friction):
        run.keep_whole()
        attempt(last.__name__.replace("_", " "), partial(go, run, last), _no)


def begin(
    problem: Problem,
    holdout: Holdout,
    remake: Callable[[Sequence[Effect]], tuple[list[Candidate], np.ndarray]],
    config: SearchConfig,
    say: Callable[[str], None],
    budget: Budget,
) -> SearchState:
    """A search at its beginning: all candidates screened."""
    run = SearchState(problem, holdout, remake, config, say)
    budget.found = lambda: max(len(run.fit.chosen), run.expected)
    run.open()
    return run


def _in_time(run: SearchState, budget: Budget, what: str, take: Callable[[], object]) -> None:
    """Call `take`; where its time ends, leave the search as it was last whole, and write down `what` was cut off."""
    run.keep_whole()
    try:
        with ending(budget.ends):
            take()
    except OutOfTime:
        run.go_back()
        budget.has_time_for(what)


def _select(run: SearchState, config: SearchConfig, budget: Budget) -> None:
    """Forward selection, and once more from the standard parameters of all joints where it stays far from the data.

    Where all servos damp too little, no single one of them brings the robot nearer.
    """
    _one_by_one(run, config, budget)
    together = partial(go, run, partial(start_with_all_joints, stuck=True))
    if budget.has_time_for("all joints at once") and run.problem.plant.failures.attempt(ALL_JOINTS, together, _no):
        _one_by_one(run, config, budget)


def _one_by_one(run: SearchState, config: SearchConfig, budget: Budget) -> None:
    """Forward selection until nothing is worth a trial, too many in a row were in vain, or the time is over."""
    vain, kept, attempt = 0, Kept(), run.problem.plant.failures.attempt
    while len(run.fit.chosen) < config.most + run.given and vain < run.patience:
        run.keep_whole()
        if not budget.has_time_for("more effects"):
            break
        now = Round(run, last=vain == run.patience - 1)
        if ask(now, PROPOSALS, kept):
            continue
        if not now.tried and not now.looked:
            break
        if not now.tried:
            run.closed |= set(now.looked)
            vain += 1
            continue
        confirmed = [t for t in now.tried if t.candidate.effect in JUDGED_ALONE and run.power() >= config.many]
        best = simplest(confirmed or now.tried, run.fit.cost, run.problem.thresholds.selection.trials)
        if best.candidate.effect in SATURATIONS and attempt("lost commands", partial(go, run, find_packet_loss), _no):
            continue  # a lost command, too, spoils a few windows
        place, name = best.candidate.where, f"the fit with {best.candidate.effect} on {best.candidate.where}"
        accepted = attempt(name, partial(run.accept, best.candidate, best.values), partial(run.refuse, best.candidate))
        vain = 0 if accepted else vain + 1
        if accepted:
            attempt("the tilt of the base's sensor", partial(go, run, whiten_where_it_leans), lambda: None)
            attempt("a torque limit in the place of a weak drive", partial(go, run, swap_limits), _no)
            run.hopeless = {(kind, where) for kind, where in run.hopeless if place and where != place}


def _any_of(run: SearchState, steps: Sequence[Callable[[SearchState], Asking[bool]]]) -> bool:
    """Whether one of the steps changed the model; those after it are not taken."""
    return any(go(run, step) for step in steps)


def _no() -> bool:
    return False
