"""The fit of all joints' usual effects: of a free base from likely sizes, of a fixed one from a regression's."""

from collections.abc import Callable, Sequence
from functools import partial, reduce

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.comparison import drop_unsure
from bumblebee.diagnosis.estimation import Fit, gauss_newton, levenberg_marquardt
from bumblebee.diagnosis.residuals import Problem, screening_windows, window_weights
from bumblebee.diagnosis.selection.proposals.all_joints.begun import (
    Begun,
    beside,
    likely_values,
    sets_of,
    usual_effects,
)
from bumblebee.diagnosis.selection.proposals.all_joints.held_joints import held_by_dry_friction
from bumblebee.diagnosis.selection.proposals.all_joints.joint_damping import one_damping
from bumblebee.diagnosis.selection.proposals.all_joints.loads import with_loads
from bumblebee.diagnosis.selection.proposals.all_joints.sure import sure_by_misfit, sure_of


def fit_all_joints(
    problem: Problem, candidates: Sequence[Candidate], found: Fit, say: Callable[[str], None], below: float = np.inf
) -> Fit | None:
    """A fit of the usual effects and of loads that are sure together, of a robot whose base is free.

    Or from those that were `found` on, together with the others, if this leads nearer to the data. The long way is
    gone on some of the windows, and what is not sure is taken out as far as the simulator bears it out. None where
    nothing is sure, or where the joints' effects do not bring those windows' median chi-square `below` what else there
    is.
    """
    rule = problem.thresholds.selection.proposals.all_joints
    usual = usual_effects(candidates)
    if not usual:
        return None
    some = problem.part(screening_windows(problem, rule.windows))
    fit = _usual(some, usual, candidates, below)
    if found.chosen:
        fit = _better(some, fit, levenberg_marquardt(some, *beside(found, usual), rule.steps))
    say(f"{len(fit.chosen)} usual effects and loads together: chi-square {fit.power(some):.3g}")
    if fit.power(some) >= below:
        return None
    for simpler in (held_by_dry_friction, one_damping):
        chosen, values = simpler(some, fit)
        if len(chosen) < len(fit.chosen):
            fit = levenberg_marquardt(some, chosen, values, rule.steps_with_links)
    if fit.power(some) < rule.off:
        sure = drop_unsure(some, fit, window_weights(fit.clean(some)), simulated=True)
        return sure_of(problem, sure, simulated=True)
    return sure_by_misfit(problem, fit)


def simulated(problem: Problem, several: Sequence[Begun]) -> Fit:
    """Simulated from each beginning, and fitted on; the first, or what leaves less by far than all before it."""
    rule = problem.thresholds.selection.proposals.all_joints
    some = problem.part(screening_windows(problem, rule.windows))
    fits = [levenberg_marquardt(some, *begun, rule.steps) for begun in several]
    best = reduce(partial(_better, some), fits)
    return gauss_newton(problem, best.chosen, best.values, np.ones(len(problem.windows)), iterations=0)


def sure_among(problem: Problem, fit: Fit) -> Fit | None:
    """The effects of a fit that are sure on all windows, after some more steps there; None where none is."""
    rule = problem.thresholds.selection.proposals.all_joints
    fit = levenberg_marquardt(problem, fit.chosen, fit.values, rule.steps)
    return sure_of(problem, fit) if fit.power(problem) < rule.still_off else sure_by_misfit(problem, fit)


def is_fixed(problem: Problem) -> bool:
    """Whether inverse dynamics says what a robot lacks: no ground pushes back."""
    return not problem.plant.floating


def _usual(problem: Problem, usual: Sequence[Candidate], candidates: Sequence[Candidate], below: float) -> Fit:
    """The usual effects at the declared strengths and loads; where much is left beside strengths, and beside kp.

    Much is more than a share of what the declared model leaves, or not `below` what else there is. A step of the
    G1 takes ten to twenty seconds of one core: all but the first set begin from the fit without them.
    """
    rule = problem.thresholds.selection.proposals.all_joints
    declared = gauss_newton(problem, (), (), window_weights(problem.residual([[]])[0])).power(problem)
    enough = min(max(rule.still_off, rule.enough * declared), below)
    first, *drives = sets_of(usual, candidates)
    fit = levenberg_marquardt(problem, first, likely_values(problem, first), rule.steps)
    best = fit = with_loads(problem, fit, candidates)
    for more in drives:
        if more and best.power(problem) >= enough:
            best = _better(problem, best, levenberg_marquardt(problem, *beside(fit, more), rule.steps_with_links))
    return best


def _better(problem: Problem, simple: Fit, other: Fit) -> Fit:
    """The other fit where it leaves less by far, else the simple one."""
    fall = problem.thresholds.comparison.together.fall
    return other if other.power(problem) < (1 - fall) * simple.power(problem) else simple
