"""When a search begins anew with the standard parameters of all joints, and how it goes on from there."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.comparison import Holdout, compare
from bumblebee.diagnosis.estimation import Fit, cost_of, gauss_newton
from bumblebee.diagnosis.residuals import Problem, make_problem, window_weights
from bumblebee.diagnosis.selection.changes import Anew, Asked, Asking, Expecting
from bumblebee.diagnosis.selection.proposals.all_joints.fit import (
    is_fixed,
    simulated,
    sure_among,
    sure_on_the_ground,
)
from bumblebee.diagnosis.selection.proposals.all_joints.standard_parameters import standard_parameters
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.trial import Trial
from bumblebee.errors import BadInput
from bumblebee.sim.effects import Effect


def whitened_anew(problem: Problem, holdout: Holdout, fit: Fit) -> tuple[Problem, Holdout, Fit]:
    """Anew to fit and to judge whitened anew around a fit that is far from the declared model, and fitted there."""
    problem = _whitened_around(problem, fit.effects)
    if holdout.problem is not None:
        holdout = replace(holdout, problem=_whitened_around(holdout.problem, fit.effects))
    weights = window_weights(problem.residual([fit.effects])[0])
    fit = gauss_newton(problem, fit.chosen, fit.values, weights, iterations=2, coarse=True)
    problem = problem.held_to(fit.power(problem))
    again = gauss_newton(problem, fit.chosen, fit.values, weights, iterations=2, coarse=True, known=fit)
    return problem, holdout, again


def _whitened_around(problem: Problem, effects: Sequence[Effect]) -> Problem:
    """The problem whitened anew, its windows restarted, around a model with `effects`; only its nuisances if it falls.

    Far from the declared model, starts that were moved to where it says that they were are not nearer to the truth.
    """
    p = problem
    try:
        steps, rng = (p.fine, p.coarsest), np.random.default_rng(0)
        made = make_problem(p.plant, p.layout, p.read, p.sigma, steps, effects, rng, p.finest, p.thresholds)
    except BadInput:  # it diverges in more than half of the windows
        return problem.relinearised(effects)
    return replace(made, between=problem.between)


def all_joints_of(run: SearchState) -> Asking[Fit | None]:
    """Standard parameters of all joints by inverse dynamics, fitted on in the simulator; many may come at once."""
    begun = standard_parameters(run.problem, run.candidates, run.config.level)
    if not begun:
        return None
    yield Expecting(max(len(chosen) for chosen, _ in begun))
    if not is_fixed(run.problem):
        return sure_on_the_ground(run.problem, begun, run.candidates, run.say)
    fit = simulated(run.problem, begun)
    run.say(f"{len(fit.chosen)} standard parameters by inverse dynamics: chi-square {fit.power(run.problem):.3g}")
    return fit


def start_with_all_joints(run: SearchState, stuck: bool = False) -> Asking[bool]:
    """Begin anew with the standard parameters of all joints, where some effects leave large residuals; whether it did.

    Only if the last of these explained little, or they are very large: else the next may explain the rest. Where the
    windows were whitened far from here they are whitened anew first, and that may be all there is to it. If no effect
    helps any more (`stuck`), large residuals on a fixed base are enough, or very large ones.
    """
    power = run.power()
    enough = 1 if power >= run.rule.many_at_once else run.rule.many_after
    early = len(run.fit.chosen) < enough or (run.fall >= run.rule.many_little and power < run.config.far)
    far = run.config.many if is_fixed(run.problem) else run.config.far
    if run.tried_many or run.given or power < run.config.many or (power < far if stuck else early):
        return False
    if run.power() < run.rule.whiten_anew * run.whitened_at:
        yield Anew(*whitened_anew(run.problem, run.holdout, run.fit))
        if run.power() < run.config.many:
            return True
    yield Asked(far=False)
    fit = yield from all_joints_of(run)
    rule = run.problem.thresholds.comparison.together
    if fit is None or not compare(run.problem, run.holdout, run.fit, fit).passes(rule):
        return False
    yield begun_with(run, fit)
    return True


def start_far_off(run: SearchState, tried: Sequence[Trial]) -> Asking[bool]:
    """Begin with the standard parameters of all joints of a robot that is far from the data; whether it did.

    Only before anything is found, where they leave next to nothing, and where no effect that was `tried` by itself
    comes near. A search effect by effect converges to a wrong local minimum where every joint errs by factors.
    """
    rule, declared = run.problem.thresholds.selection.proposals.all_joints, run.power()
    if run.asked_far or run.fit.chosen or declared < run.config.far:
        return False
    if not is_fixed(run.problem) and not _is_worth_minutes(run, tried):
        return False
    yield Asked(far=True)
    fit = yield from all_joints_of(run)
    if fit is None or fit.power(run.problem) >= max(rule.still_off, rule.little * declared):
        return False
    if not is_nearer(run, fit, tried):
        return False
    if not compare(run.problem, run.holdout, run.fit, fit).passes(run.problem.thresholds.comparison.together):
        return False
    yield begun_with(run, fit)
    return True


def is_nearer(run: SearchState, fit: Fit, tried: Sequence[Trial]) -> bool:
    """Whether a fit of many effects leaves a share of what the best of some trials of single ones leaves."""
    nearer = run.problem.thresholds.selection.proposals.all_joints.nearer
    least = min((t.cost for t in tried), default=np.inf)
    return cost_of(run.problem, fit.residual, run.weights)[0] < nearer * least


def _is_worth_minutes(run: SearchState, tried: Sequence[Trial]) -> bool:
    """Whether all joints of a free base may err: no effect of one place explains much, none of all leaves little."""
    place = (1 - run.rule.most_of_it) * run.fit.cost
    whole = run.problem.thresholds.selection.proposals.all_joints.nearer * run.fit.cost
    return all(t.cost > (place if t.candidate.where else whole) for t in tried)


def begun_with(run: SearchState, fit: Fit) -> Anew:
    """A beginning anew with many effects at once; standard parameters that are not sure there are taken out."""
    problem, holdout, fit = whitened_anew(run.problem, run.holdout, fit)
    if is_fixed(problem):
        fit = sure_among(problem, fit) or fit
    return Anew(problem, holdout, fit, begun=True)
