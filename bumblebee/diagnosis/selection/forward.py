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
from bumblebee.diagnosis.selection.proposals.all_joints import start_far_off, start_with_all_joints
from bumblebee.diagnosis.selection.proposals.backlash import backlash_trials
from bumblebee.diagnosis.selection.proposals.declared_scale import keep_declared_scale
from bumblebee.diagnosis.selection.proposals.drive_grid import drive_trials
from bumblebee.diagnosis.selection.proposals.friction_family import complete_frictions
from bumblebee.diagnosis.selection.proposals.gain_grid import start_with_gain_grid
from bumblebee.diagnosis.selection.proposals.gain_parameters import merge_gain_parameters
from bumblebee.diagnosis.selection.proposals.joint_elasticity import joint_elasticity_trials
from bumblebee.diagnosis.selection.proposals.packet_loss import find_packet_loss
from bumblebee.diagnosis.selection.proposals.saturation import saturation_trials
from bumblebee.diagnosis.selection.proposals.setpoints import setpoint_trials
from bumblebee.diagnosis.selection.proposals.stribeck import add_dry_friction, add_stribeck_friction
from bumblebee.diagnosis.selection.proposals.surface_contact import surface_trials
from bumblebee.diagnosis.selection.proposals.torque_ripple import ripple_trials
from bumblebee.diagnosis.selection.score_tests import Scores
from bumblebee.diagnosis.selection.state import Loss, SearchState
from bumblebee.diagnosis.selection.swap import swap, swap_limits
from bumblebee.diagnosis.selection.trial import Trial, simplest
from bumblebee.diagnosis.sensitivities import Columns
from bumblebee.diagnosis.simulation import OutOfTime, ending
from bumblebee.sim.effects import Effect

_ALL_JOINTS = "the usual effects of all joints"


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
    if attempt("lost commands", partial(find_packet_loss, run), _no):
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
    for last in (SearchState.prune, keep_declared_scale, merge_gain_parameters, add_dry_friction):
        run.keep_whole()
        attempt(last.__name__.replace("_", " "), partial(last, run), _no)


def begin(
    problem: Problem,
    holdout: Holdout,
    remake: Callable[[Sequence[Effect]], tuple[list[Candidate], np.ndarray]],
    config: SearchConfig,
    say: Callable[[str], None],
    budget: Budget,
) -> SearchState:
    """A search at its beginning: with servos far from the declared ones if need be, and all candidates screened."""
    run = SearchState(problem, holdout, remake, config, say)
    name, far = "gains far from the declared ones", partial(start_with_gain_grid, run)
    _in_time(run, budget, name, partial(problem.plant.failures.attempt, name, far, _no))
    run.open()
    return run


def _in_time(run: SearchState, budget: Budget, what: str, take: Callable[[], object]) -> None:
    """Call `take`; where its time ends, leave the search as it was last whole, and write down `what` was cut off."""
    run.keep_whole()
    try:
        with ending(budget.over):
            take()
    except OutOfTime:
        run.go_back()
        budget.has_time_for(what)


def _select(run: SearchState, config: SearchConfig, budget: Budget) -> None:
    """Forward selection, and once more from the usual effects of all joints where it stays far from the data.

    Where all servos damp too little, no single one of them brings the robot nearer.
    """
    _one_by_one(run, config, budget)
    together = partial(start_with_all_joints, run, stuck=True)
    if budget.has_time_for("all joints at once") and run.problem.plant.failures.attempt(_ALL_JOINTS, together, _no):
        _one_by_one(run, config, budget)


def _one_by_one(run: SearchState, config: SearchConfig, budget: Budget) -> None:
    """Forward selection until nothing is worth a trial, too many in a row were in vain, or the time is over."""
    vain, judged, touching, attempt = 0, None, _Touching(run), run.problem.plant.failures.attempt
    limits: list[Trial] = []
    while len(run.fit.chosen) < config.most + run.given and vain < run.patience:
        run.keep_whole()
        if not budget.has_time_for("more effects"):
            break
        tried, looked, anew = look_around(run)
        if anew:
            continue
        tried += attempt("contact with a surface", touching.trials, list)
        late: list[Trial] = attempt("drives that follow their targets late", partial(setpoint_trials, run, tried), list)
        tried += [t for t in late if t.candidate not in run.closed]
        tried += attempt("torque ripple", partial(ripple_trials, run, tried), list)
        some = _where_limits_matter(tried, run)
        if judged != (run.fit, some):
            judged = (run.fit, some)
            limits = attempt("limits of drives", partial(_limits, run, some), list)
        tried += [t for t in limits if t.candidate not in run.closed]
        if not tried:
            tried = attempt("backlash", partial(_of_joints, backlash_trials, run), list)
            tried = [t for t in tried if t.candidate not in run.closed]
        if not tried or vain == run.patience - 1:
            tried += attempt("joint elasticity", partial(_of_joints, joint_elasticity_trials, run), list)
        if not tried and not looked:
            break
        if not tried:
            run.closed |= set(looked)
            vain += 1
            continue
        confirmed = [t for t in tried if t.candidate.effect in JUDGED_ALONE and run.power() >= config.many]
        best = simplest(confirmed or tried, run.fit.cost, run.problem.thresholds.selection.trials)
        if best.candidate.effect in SATURATIONS and attempt("lost commands", partial(find_packet_loss, run), _no):
            continue  # a lost command, too, spoils a few windows
        place, name = best.candidate.where, f"the fit with {best.candidate.effect} on {best.candidate.where}"
        accepted = attempt(name, partial(run.accept, best.candidate, best.values), partial(run.refuse, best.candidate))
        vain = 0 if accepted else vain + 1
        if accepted:
            attempt("a torque limit in the place of a weak drive", partial(swap_limits, run), _no)
            run.hopeless = {(kind, where) for kind, where in run.hopeless if place and where != place}


def look_around(run: SearchState) -> tuple[list[Trial], list[Candidate], bool]:
    """Trials of single effects, those looked at; and whether the search began anew with effects of all joints."""
    attempt = run.problem.plant.failures.attempt
    tried, looked = single_trials(run)
    anew = attempt(_ALL_JOINTS, partial(start_far_off, run, tried), _no)
    if not anew and not _explains_much(tried, run):
        anew = attempt(_ALL_JOINTS, partial(start_with_all_joints, run), _no)
    return tried, looked, anew


def single_trials(run: SearchState) -> tuple[list[Trial], list[Candidate]]:
    """Trials of single effects, and those looked at; drives far from the declared ones first."""
    attempt = run.problem.plant.failures.attempt
    tried: list[Trial] = []
    looked: list[Candidate] = []
    if not run.given:
        tried = attempt("drives far from the declared ones", partial(_drives, run), list)
        tried = [t for t in tried if t.candidate not in run.closed]
    if all(t.candidate.effect in SATURATIONS for t in tried):  # a limit alone does not say that slopes are none
        more, looked = attempt("trials of the best candidates", run.trials, lambda: ([], []))
        tried += more
    return tried, looked


class _Touching:
    """Contacts with a surface that the model lacks, sought once for each fit."""

    def __init__(self, run: SearchState) -> None:
        self.run = run
        self.fit: Fit | None = None
        self.found: list[Trial] = []

    def trials(self) -> list[Trial]:
        """The best, if none was refused there."""
        run = self.run
        if self.fit is not run.fit:
            self.fit = run.fit
            self.found = surface_trials(
                run.problem, run.fit, run.candidates, run.weights, tuple(run.closed), run.holdout.problem
            )
        return [t for t in self.found if t.candidate not in run.closed]


def _drives(run: SearchState) -> list[Trial]:
    return drive_trials(run.problem, run.fit, run.candidates, run.weights, run.config.far)


def _limits(run: SearchState, some: Sequence[Candidate]) -> list[Trial]:
    return saturation_trials(run.problem, run.fit, some, run.weights, run.hopeless, run.changes)


def _of_joints(trials: Callable[..., list[Trial]], run: SearchState) -> list[Trial]:
    return trials(run.problem, run.fit, run.candidates, run.weights, run.hopeless)


def _any_of(run: SearchState, steps: Sequence[Callable[[SearchState], bool]]) -> bool:
    """Whether one of the steps changed the model; those after it are not taken."""
    return any(step(run) for step in steps)


def _no() -> bool:
    return False


def _explains_much(tried: Sequence[Trial], run: SearchState) -> bool:
    """Whether one trial takes away much of the cost: then effects are found one after the other."""
    return min((t.cost for t in tried), default=np.inf) <= (1 - run.rule.most_of_it) * run.fit.cost


def _where_limits_matter(tried: Sequence[Trial], run: SearchState) -> tuple[Candidate, ...]:
    """The candidates among which limits are tried: all, or while one trial explains much the places of these trials.

    What a limit does may pass for weakness or friction of its joint, and then the two are compared; a limit elsewhere
    is judged when the large effects are known.
    """
    if not _explains_much(tried, run):
        return tuple(run.candidates)
    places = {t.candidate.where for t in tried}
    return tuple(c for c in run.candidates if c.where in places)
