"""The fit of all joints' usual effects, from where they are absent on; of a large robot from likely sizes."""

from collections.abc import Callable, Sequence
from functools import partial, reduce

import numpy as np

from bumblebee.diagnosis.candidates import USUAL_OF_BODIES, Candidate, clipped, is_chosen
from bumblebee.diagnosis.comparison import drop_unsure
from bumblebee.diagnosis.estimation import Fit, gauss_newton, levenberg_marquardt
from bumblebee.diagnosis.residuals import Problem, screening_windows, window_weights
from bumblebee.diagnosis.selection.proposals.all_joints.begun import (
    ROTOR,
    Begun,
    beside,
    is_whole,
    likely_values,
    sets_of_large,
    sets_of_small,
    usual_effects,
)
from bumblebee.diagnosis.selection.proposals.all_joints.held_joints import held_by_dry_friction
from bumblebee.diagnosis.selection.proposals.all_joints.joint_damping import one_damping
from bumblebee.diagnosis.selection.proposals.all_joints.link_load import link_load
from bumblebee.diagnosis.selection.proposals.all_joints.loads import with_loads
from bumblebee.diagnosis.selection.proposals.all_joints.sure import sure_by_misfit, sure_of


def fit_all_joints(
    problem: Problem, candidates: Sequence[Candidate], found: Fit, say: Callable[[str], None], below: float = np.inf
) -> Fit | None:
    """A fit of a load, the usual effects or both that are sure together.

    Or from those that were `found` on, together with the others, if this leads nearer to the data. The long way is
    gone on some of the windows, and what is not sure is taken out by the slopes there, of a large robot as far as the
    simulator bears it out. Of a small robot with large residuals still masses and centres of mass follow, all at once.
    None where nothing is sure, or where the joints' effects do not bring those windows' median chi-square `below` what
    else there is.
    """
    rule = problem.thresholds.selection.proposals.all_joints
    usual = usual_effects(candidates)
    if not usual:
        return None
    some = problem.part(screening_windows(problem, rule.windows))
    small = is_small(problem)
    steps = rule.steps_of_small if small else rule.steps
    fit = _of_small(some, usual, candidates) if small else _of_large(some, usual, candidates, below)
    if found.chosen:
        fit = _better(some, fit, levenberg_marquardt(some, *beside(found, usual), steps))
    say(f"{len(fit.chosen)} usual effects and loads together: chi-square {fit.power(some):.3g}")
    if fit.power(some) >= below:
        return None
    for kind in USUAL_OF_BODIES if small else ():
        fit = _with_links(some, fit, [c for c in candidates if c.effect == kind and is_whole(c)], say)
    for simpler in (one_damping,) if small else (held_by_dry_friction, one_damping):
        chosen, values = simpler(some, fit)
        if len(chosen) < len(fit.chosen):
            fit = levenberg_marquardt(some, chosen, values, rule.steps_with_links)
    if fit.power(some) < (rule.still_off if small else rule.off_of_large):
        sure = drop_unsure(some, fit, window_weights(fit.clean(some)), simulated=not small)
        return sure_of(problem, sure, simulated=not small)
    return sure_by_misfit(problem, fit)


def simulated(problem: Problem, several: Sequence[Begun]) -> Fit:
    """Simulated from each beginning, and fitted on; the fit that leaves least."""
    rule = problem.thresholds.selection.proposals.all_joints
    some = problem.part(screening_windows(problem, rule.windows))
    fits = [levenberg_marquardt(some, *begun, rule.steps) for begun in several]
    best = min(fits, key=lambda fit: fit.power(some))
    return gauss_newton(problem, best.chosen, best.values, np.ones(len(problem.windows)), iterations=0)


def sure_among(problem: Problem, fit: Fit) -> Fit | None:
    """The effects of a fit that are sure on all windows, after some more steps there; None where none is."""
    rule = problem.thresholds.selection.proposals.all_joints
    fit = levenberg_marquardt(problem, fit.chosen, fit.values, rule.steps)
    return sure_of(problem, fit) if fit.power(problem) < rule.still_off else sure_by_misfit(problem, fit)


def is_small(problem: Problem) -> bool:
    """Whether a robot's links can be asked all at once."""
    most = problem.thresholds.selection.proposals.all_joints.small_robot
    return problem.plant.model.nv <= most and not problem.plant.floating


def is_told_torques(problem: Problem) -> bool:
    """Whether inverse dynamics says what a robot lacks: torques are logged, and no ground pushes back.

    Without any drive nothing says how heavy the links are.
    """
    plant = problem.plant
    return plant.torque_input and not plant.floating and bool((plant.actuator >= 0).any())


def _of_small(problem: Problem, usual: Sequence[Candidate], candidates: Sequence[Candidate]) -> Fit:
    """A load alone that leaves little, else the first sets that do, or what leaves much less than all before it."""
    rule, better = problem.thresholds.selection.proposals.all_joints, partial(_better, problem)
    fits = list(link_load(problem, candidates))
    for several in sets_of_small(usual, candidates, fits):
        if fits and reduce(better, fits).power(problem) < rule.still_off:
            break
        fits += [_from_both_ends(problem, begun, rule.steps_of_small) for begun in several]
    return reduce(better, fits)


def _of_large(problem: Problem, usual: Sequence[Candidate], candidates: Sequence[Candidate], below: float) -> Fit:
    """The usual effects at the declared strengths and loads; where much is left beside strengths, and beside kp.

    Much is more than a share of what the declared model leaves, or not `below` what else there is. A step of the
    G1 takes ten to twenty seconds of one core: all but the first set begin from the fit without them.
    """
    rule = problem.thresholds.selection.proposals.all_joints
    declared = gauss_newton(problem, (), (), window_weights(problem.residual([[]])[0])).power(problem)
    enough = min(max(rule.still_off, rule.enough_of_large * declared), below)
    first, *drives = sets_of_large(usual, candidates)
    fit = levenberg_marquardt(problem, first, likely_values(problem, first), rule.steps)
    best = fit = with_loads(problem, fit, candidates)
    for more in drives:
        if more and best.power(problem) >= enough:
            best = _better(problem, best, levenberg_marquardt(problem, *beside(fit, more), rule.steps_with_links))
    return best


def _from_both_ends(problem: Problem, begun: Begun, steps: int) -> Fit:
    """The fit from where it begins or, if that leaves much, from rotors much heavier than the links.

    A joint that hardly has an inertia follows its servo at once, and next to none does not differ from none.
    """
    rule = problem.thresholds.selection.proposals.all_joints
    chosen, values = begun
    fit = levenberg_marquardt(problem, chosen, values, steps)
    heavy = np.concatenate([(rule.rotors if c.effect == ROTOR else 0.0) * np.array(c.step) for c in chosen])
    if fit.power(problem) < rule.still_off or not heavy.any():
        return fit
    other = levenberg_marquardt(problem, chosen, clipped(chosen, values + heavy), steps)
    return min(fit, other, key=lambda f: f.power(problem))


def _better(problem: Problem, simple: Fit, other: Fit) -> Fit:
    """The other fit where it leaves less by far, else the simple one."""
    fall = problem.thresholds.comparison.together.fall
    return other if other.power(problem) < (1 - fall) * simple.power(problem) else simple


def _with_links(problem: Problem, fit: Fit, bodies: Sequence[Candidate], say: Callable[[str], None]) -> Fit:
    """The fit with one kind of effect on all links, if its residuals are large and these make them smaller."""
    rule = problem.thresholds.selection.proposals.all_joints
    bodies = [c for c in bodies if not is_chosen(c, fit.chosen)]
    if not bodies or fit.power(problem) < rule.still_off:
        return fit
    larger = levenberg_marquardt(problem, *beside(fit, bodies), rule.steps_with_links)
    say(f"{len(larger.chosen)} with {bodies[0].effect} on all links: chi-square {larger.power(problem):.3g}")
    return _better(problem, fit, larger)
