"""The fit of all joints at once: begun by regressions on inverse dynamics, gone on with in the simulator."""

from collections.abc import Callable, Sequence
from functools import partial, reduce

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, absent, effects_at
from bumblebee.diagnosis.comparison import drop_unsure
from bumblebee.diagnosis.estimation import Fit, cost_of, gauss_newton, levenberg_marquardt, typical_power
from bumblebee.diagnosis.residuals import Problem, screening_windows, window_weights
from bumblebee.diagnosis.selection.proposals.all_joints.held_joints import held_by_dry_friction
from bumblebee.diagnosis.selection.proposals.all_joints.loads import with_loads
from bumblebee.diagnosis.selection.proposals.all_joints.standard_parameters import Begun
from bumblebee.diagnosis.selection.proposals.all_joints.sure import sure_by_misfit, sure_of
from bumblebee.effects.kind import Kind
from bumblebee.sim.effects import CATALOGUE


def simulated(problem: Problem, several: Sequence[Begun]) -> Fit:
    """Simulated from each beginning, and fitted on; the first, or what leaves less by far than all before it."""
    some, rule = _some(problem), problem.thresholds.selection.proposals.all_joints
    fits = [levenberg_marquardt(some, *begun, rule.steps) for begun in several]
    best = reduce(partial(_better, some), fits)
    return gauss_newton(problem, best.chosen, best.values, np.ones(len(problem.windows)), iterations=0)


def not_simulated(problem: Problem, several: Sequence[Begun]) -> Fit:
    """The nearest beginning as it is."""
    chosen, values = _nearest(problem, several)
    return gauss_newton(problem, chosen, values, np.ones(len(problem.windows)), iterations=0)


def sure_on_the_ground(
    problem: Problem, several: Sequence[Begun], candidates: Sequence[Candidate], say: Callable[[str], None]
) -> Fit | None:
    """Effects of a robot whose base is free, and its loads, that are sure together; None where nothing is.

    A step of a G1's fit takes ten to twenty seconds of one core: they are taken from the nearest beginning alone, on
    some of the windows, and what is not sure is taken out as far as the simulator bears it out. What every joint has
    and no torque stands for, the offset of its encoder, is beside it from none on.
    """
    some, rule = _some(problem), problem.thresholds.selection.proposals.all_joints
    chosen, values = _nearest(some, several)
    unseen = [c for c in candidates if c.where and _is_unseen(CATALOGUE[c.effect])]
    begun = (*chosen, *unseen), np.concatenate((values, absent(unseen)))
    fit = with_loads(some, levenberg_marquardt(some, *begun, rule.steps), candidates)
    say(f"{len(fit.chosen)} standard parameters and loads together: chi-square {fit.power(some):.3g}")
    chosen, values = held_by_dry_friction(some, fit)
    if len(chosen) < len(fit.chosen):
        fit = levenberg_marquardt(some, chosen, values, rule.steps_with_links)
    if fit.power(some) < rule.off:
        sure = drop_unsure(some, fit, window_weights(fit.clean(some)), simulated=True)
        return sure_of(problem, sure, simulated=True)
    return sure_by_misfit(problem, fit)


def sure_among(problem: Problem, fit: Fit) -> Fit | None:
    """The effects of a fit that are sure on all windows, after some more steps there; None where none is."""
    rule = problem.thresholds.selection.proposals.all_joints
    fit = levenberg_marquardt(problem, fit.chosen, fit.values, rule.steps)
    return sure_of(problem, fit) if fit.power(problem) < rule.still_off else sure_by_misfit(problem, fit)


def is_fixed(problem: Problem) -> bool:
    """Whether no ground pushes back."""
    return not problem.plant.floating


def _is_unseen(kind: Kind) -> bool:
    return kind.usual == "joint" and kind.column == "simulated"


def _some(problem: Problem) -> Problem:
    return problem.part(screening_windows(problem, problem.thresholds.selection.proposals.all_joints.windows))


def _nearest(problem: Problem, several: Sequence[Begun]) -> Begun:
    """The first beginning, or one whose median chi-square is less by far than those of all before it."""

    def left(begun: Begun) -> float:
        residual = problem.residual([effects_at(*begun)])[0]
        _, nuisance = cost_of(problem, residual, window_weights(residual))
        return typical_power(residual - np.tensordot(nuisance, problem.nuisance, axes=1))

    enough = 1 - problem.thresholds.comparison.together.fall
    powers = [left(begun) for begun in several]
    return several[
        reduce(lambda one, other: other if powers[other] < enough * powers[one] else one, range(len(powers)))
    ]


def _better(problem: Problem, simple: Fit, other: Fit) -> Fit:
    """The other fit where it leaves less by far, else the simple one."""
    fall = problem.thresholds.comparison.together.fall
    return other if other.power(problem) < (1 - fall) * simple.power(problem) else simple
