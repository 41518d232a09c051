"""Parameters wrong on all joints at once: what every joint of a real robot has, fitted together.

A robot with friction and latency on every joint is found one effect at a time only by a long way round: each effect
alone explains a twentieth, and what stands for the others' share has a strange name. Where residuals are large still
after two effects (after one, where they are hundreds of times the noise), and the last explained little or they are
very large, the usual ones of all joints are fitted together from the declared values on, or from those found. The
drives' strengths are free only where the data need them: a servo's strength, its joint's inertia and its friction go by
one common factor nearly as a torque drive's do (`declared_scale`). Of a small robot a load on one link is asked first,
by itself and then beside them (`link_load`): it weakens all drives as far as these can tell. Where residuals stay large
masses and centres of mass of all links follow. What is not sure is taken out again, and the rest has to pay on windows
that took no part; these and the fitted ones are then whitened anew, and the search goes on from there. It begins so in
the place of gains far from the declared ones (`gain_grid`), and on a small robot far from the data where they leave
next to nothing and no effect that was tried by itself comes near.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial, reduce

import numpy as np

from bumblebee.diagnosis.candidates import (
    USUAL,
    USUAL_OF_BODIES,
    USUAL_OF_ROBOT,
    USUAL_OF_TORQUE,
    Candidate,
    absent,
    clipped,
    is_chosen,
)
from bumblebee.diagnosis.comparison import Holdout, certainty, compare, drop_unsure, evidence
from bumblebee.diagnosis.estimation import Fit, cost_of, gauss_newton, levenberg_marquardt
from bumblebee.diagnosis.residuals import Problem, by_misfit, make_problem, screening_windows, window_weights
from bumblebee.diagnosis.selection.proposals.joint_damping import one_damping
from bumblebee.diagnosis.selection.proposals.link_load import link_load
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.errors import BadInput
from bumblebee.sim.effects import Effect

_STRENGTH = "motor_strength"
_GAIN = "kp"
_ROTOR = "armature"
_Begun = tuple[Sequence[Candidate], np.ndarray]
"""Effects and the values (P,) that their fit begins with."""


def usual_effects(candidates: Sequence[Candidate], torque: bool = False) -> list[Candidate]:
    """Of `candidates` those that every joint of a real robot has; `torque`: whose drives are told torques."""
    kinds = USUAL_OF_TORQUE if torque else USUAL
    return [c for c in candidates if (c.effect in kinds and c.where) or (c.effect in USUAL_OF_ROBOT and not c.where)]


def is_whole(c: Candidate) -> bool:
    """Whether a mass takes the moments along, as another link of the same shape would; other effects do."""
    return c.effect != "link_mass" or c.step[1] != 0


def fit_all_joints(
    problem: Problem, candidates: Sequence[Candidate], found: Fit, say: Callable[[str], None], below: float = np.inf
) -> Fit | None:
    """A fit of a load, the usual effects or both, from the declared values on, that are sure together.

    Or from those that were `found` on, together with the others, if this leads nearer to the data. The long way is
    gone on some of the windows, and what is not sure is taken out by the slopes there. Of a small robot with large
    residuals still masses and centres of mass follow, all at once. None where nothing is sure, or where the joints'
    effects do not bring those windows' median chi-square `below` what else there is.
    """
    rule = problem.thresholds.selection.proposals.all_joints
    usual = usual_effects(candidates, problem.plant.torque_input)
    if not usual:
        return None
    some = problem.part(screening_windows(problem, rule.windows))
    small = _is_small(problem)
    steps = rule.steps_of_small if small else rule.steps
    loads = link_load(some, candidates) if small else ()
    fit = _simplest(some, loads, _sets(usual, candidates, loads), steps)
    if found.chosen:
        fit = _better(some, fit, levenberg_marquardt(some, *_beside(found, usual), steps))
    say(f"{len(fit.chosen)} usual effects and loads together: chi-square {fit.power(some):.3g}")
    if fit.power(some) >= below:
        return None
    for kind in USUAL_OF_BODIES if small else ():
        fit = _with_links(some, fit, [c for c in candidates if c.effect == kind and is_whole(c)], say)
    chosen, values = one_damping(some, fit)
    if len(chosen) < len(fit.chosen):
        fit = levenberg_marquardt(some, chosen, values, rule.steps_with_links)
    if fit.power(some) < rule.still_off:
        return _sure_of(problem, drop_unsure(some, fit, window_weights(fit.clean(some))))
    return _sure_by_misfit(problem, fit)


def _is_small(problem: Problem) -> bool:
    """Whether a robot's links can be asked all at once."""
    most = problem.thresholds.selection.proposals.all_joints.small_robot
    return problem.plant.model.nv <= most and not problem.plant.floating


def _sets(usual: Sequence[Candidate], candidates: Sequence[Candidate], loads: Sequence[Fit]) -> list[list[_Begun]]:
    """Usual effects at every drive's declared strength; beside a load; with strengths; with servos' `kp` for those."""
    declared = [c for c in usual if c.effect != _STRENGTH]
    gains = [c for c in candidates if c.effect == _GAIN]
    beside = [_beside_load(load, declared) for load in loads]
    sets = [declared, list(usual), [*declared, *gains] if gains else []]
    begun: list[list[_Begun]] = [[(s, absent(s))] for k, s in enumerate(sets) if s and s not in sets[:k]]
    return [begun[0], beside, *begun[1:]]


def _beside(fit: Fit, others: Sequence[Candidate]) -> _Begun:
    """The effects of a fit where they are, and others from where they are absent."""
    there = {(c.effect, c.where) for c in fit.chosen}
    more = [c for c in others if (c.effect, c.where) not in there]
    return [*fit.chosen, *more], np.concatenate((fit.values, absent(more)))


def _beside_load(load: Fit, others: Sequence[Candidate]) -> _Begun:
    """The mass where it is, and others from where they are absent.

    Its centre among these: fitted without them it may have taken the place of what a joint lacks.
    """
    mass, *centre = load.chosen
    more = [*centre, *others]
    return [mass, *more], np.concatenate((load.of(mass), absent(more)))


def _simplest(problem: Problem, loads: Sequence[Fit], sets: Sequence[Sequence[_Begun]], steps: int) -> Fit:
    """A load alone that leaves little, else the first sets that do, or what leaves much less than all before it."""
    rule, better = problem.thresholds.selection.proposals.all_joints, partial(_better, problem)
    fits = list(loads)
    for several in sets:
        if fits and reduce(better, fits).power(problem) < rule.still_off:
            break
        fits += [_from_both_ends(problem, begun, steps) for begun in several]
    return reduce(better, fits)


def _from_both_ends(problem: Problem, begun: _Begun, steps: int) -> Fit:
    """The fit from where it begins or, if a small robot's leaves much, from rotors much heavier than the links.

    A joint that hardly has an inertia follows its servo at once, and next to none does not differ from none.
    """
    rule = problem.thresholds.selection.proposals.all_joints
    chosen, values = begun
    fit = levenberg_marquardt(problem, chosen, values, steps)
    heavy = np.concatenate([(rule.rotors if c.effect == _ROTOR else 0.0) * np.array(c.step) for c in chosen])
    if fit.power(problem) < rule.still_off or not heavy.any() or not _is_small(problem):
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
    larger = levenberg_marquardt(problem, *_beside(fit, bodies), rule.steps_with_links)
    say(f"{len(larger.chosen)} with {bodies[0].effect} on all links: chi-square {larger.power(problem):.3g}")
    return _better(problem, fit, larger)


def _sure_of(problem: Problem, fit: Fit) -> Fit | None:
    """The same effects fitted on all windows, less those that are not sure there."""
    known = None
    for _ in range(problem.thresholds.selection.proposals.all_joints.rounds):
        if not fit.chosen:
            return None
        fit = _fitted(problem, fit, 2, known)
        sure = drop_unsure(problem, fit, window_weights(fit.clean(problem)))
        if sure.chosen == fit.chosen:
            return fit
        known, fit = fit, sure
    return _fitted(problem, fit, 0, known) if fit.chosen else None  # what was dropped last, by slopes alone


def _sure_by_misfit(problem: Problem, fit: Fit) -> Fit | None:
    """The same where the windows stay far from the noise: what is sure is asked by what is left, not by the noise.

    By the noise's measure hardly any effect would be sure there.
    """
    other = by_misfit(problem, _fitted(problem, fit, 0).clean(problem))
    sure = _sure_of(other, _fitted(other, fit, 2))
    return None if sure is None else _fitted(problem, sure, 0)


def _fitted(problem: Problem, fit: Fit, iterations: int, known: Fit | None = None) -> Fit:
    """The same effects fitted from where they are, windows weighed by what is left there."""
    weights = window_weights(problem.residual([fit.effects])[0])
    least = problem.thresholds.estimation.levenberg_marquardt.damping
    return gauss_newton(problem, fit.chosen, fit.values, weights, iterations, coarse=True, damping=least, known=known)


def whitened_anew(problem: Problem, holdout: Holdout, fit: Fit) -> tuple[Problem, Holdout, Fit]:
    """Windows to fit and to judge whitened anew around a fit that is far from the declared model, and fitted there."""
    problem = _whitened_around(problem, fit.effects)
    if holdout.problem is not None:
        holdout = replace(holdout, problem=_whitened_around(holdout.problem, fit.effects))
    weights = window_weights(problem.residual([fit.effects])[0])
    fit = gauss_newton(problem, fit.chosen, fit.values, weights, iterations=2, coarse=True)
    problem = problem.held_to(fit.power(problem))
    return problem, holdout, gauss_newton(problem, fit.chosen, fit.values, weights, iterations=2, coarse=True)


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


def start_with_all_joints(run: SearchState, stuck: bool = False) -> bool:
    """Begin anew with the usual effects of all joints, where some effects leave large residuals; whether it did.

    Only if the last of these explained little, or they are very large: else the next may explain the rest. Where the
    windows were whitened far from here they are whitened anew first, and that may be all there is to it. If no effect
    helps any more (`stuck`), large residuals of a small robot are enough, or very large ones.
    """
    power = run.power()
    enough = 1 if power >= run.rule.many_at_once else run.rule.many_after
    early = len(run.fit.chosen) < enough or (run.fall >= run.rule.many_little and power < run.config.far)
    far = run.config.many if _is_small(run.problem) else run.config.far
    if run.tried_many or run.given or power < run.config.many or (power < far if stuck else early):
        return False
    if run.power() < run.rule.whiten_anew * run.whitened_at:
        _start_anew(run, *whitened_anew(run.problem, run.holdout, run.fit))
        run.say(f"whitened anew around what was found: chi-square {run.power():.3g}")
        if run.power() < run.config.many:
            return True
    run.tried_many = True
    fit = fit_all_joints(run.problem, run.candidates, run.fit, run.say)
    rule = run.problem.thresholds.comparison.together
    if fit is None or not compare(run.problem, run.holdout, run.fit, fit).passes(rule):
        return False
    begin_with(run, fit)
    return True


def start_far_off(run: SearchState, least: float) -> bool:
    """Begin with the usual effects of all joints of a small robot that is far from the data; whether it did.

    Only before anything is found, where they leave next to nothing, and where no effect that was tried by itself comes
    near: the cheapest costs `least`. One effect after the other leads into a by-way where every joint errs by factors.
    """
    rule, declared = run.problem.thresholds.selection.proposals.all_joints, run.power()
    if run.asked_far or run.fit.chosen or declared < run.config.far or not _is_small(run.problem):
        return False
    run.asked_far = True
    fit = fit_all_joints(run.problem, run.candidates, run.fit, run.say)
    if fit is None or fit.power(run.problem) >= max(rule.still_off, rule.next_to_nothing * declared):
        return False
    if cost_of(run.problem, fit.residual, run.weights)[0] >= rule.nearer * least:
        return False
    if not compare(run.problem, run.holdout, run.fit, fit).passes(run.problem.thresholds.comparison.together):
        return False
    begin_with(run, fit)
    return True


def begin_with(run: SearchState, fit: Fit) -> None:
    """Begin anew with many effects at once, which are not fitted so again."""
    _start_anew(run, *whitened_anew(run.problem, run.holdout, fit))
    z = certainty(run.problem, run.fit, run.weights)
    run.steps = [evidence(c, float(least), len(run.candidates)) for c, least in zip(run.fit.chosen, z, strict=True)]
    run.say(f"begun anew with {len(run.fit.chosen)} effects together: chi-square {run.power():.3g}")
    run.tried_many, run.given = True, len(run.fit.chosen)
    run.patience = min(run.patience, run.rule.many_patience)


def _start_anew(run: SearchState, problem: Problem, holdout: Holdout, fit: Fit) -> None:
    """Go on from a fit to windows that were whitened around it; what was tried in vain before may be tried again."""
    run.problem, run.holdout, run.fit = problem, holdout, fit
    run.keep = screening_windows(problem, run.config.screen_windows)
    run.weights = window_weights(fit.clean(problem))
    run.whitened_at = run.power()
    run.closed.clear()
    run.hopeless.clear()
    run.rescreen()
