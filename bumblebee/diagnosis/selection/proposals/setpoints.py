"""Set-points that a drive makes of its targets, tried at many sizes in the place of what passes for them.

A filter of 30 ms is far from the 5 ms at which it is screened, and in part it looks like a delay, like damping, or like
commands that come late here and there; a limited rate or acceleration acts more on large steps than on small ones. So
where an effect of that kind was found, filters, rates and profiles of a series of sizes are tried instead of it on the
windows that are furthest off, and the best of them on all. It takes the place if the joint fit says so
(`selection/swap.py`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, is_chosen, rough
from bumblebee.diagnosis.comparison import columns_without, criterion, linear_cost
from bumblebee.diagnosis.estimation import Fit, LeftOver, gauss_newton, typical_power
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.changes import Asking, Vain
from bumblebee.diagnosis.selection.profile import profile, reachable, stepped
from bumblebee.diagnosis.selection.proposals.joint_misfit import falls, joint_chi_squares, odd_joints
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.trial import Trial
from bumblebee.diagnosis.simulation import begin_setpoints, setpoints_of
from bumblebee.sim.effects import SETPOINTS, Effect

TIMING = ("command_delay", "torque_lag", "encoder_delay", *SETPOINTS)
# What else a drive that follows its targets late or slowly passes for.
LIKE = (*TIMING, "kp", "kd", "motor_strength", "viscous_friction", "armature", "load_dependent_friction")
Swapped = tuple[Fit, Trial]
"""A fit without some names, and what is tried in their place."""


def setpoint_swaps(run: SearchState, free: Sequence[Candidate]) -> Iterator[Swapped | Vain]:
    """Set-points in the place of what they pass for, for each place that has such a name among the `free` ones."""
    for where in dict.fromkeys(c.where for c in free if c.effect in TIMING):
        like = [c for c in free if c.where == where and c.effect in LIKE]
        timing = [c for c in like if c.effect in TIMING]
        for gone in [timing, like] if len(like) > len(timing) else [timing]:
            key = (" ".join(sorted(c.effect for c in gone)), where)
            if key in run.hopeless:
                continue
            yield Vain(*key)
            rest = columns_without(run.problem, run.fit, gone)
            own = linear_cost(run.problem, rest, run.weights) - linear_cost(run.problem, run.fit, run.weights)
            kinds = {c.effect for c in gone if c.effect in SETPOINTS}
            least = run.problem.thresholds.selection.swap.part * own
            for trial in setpoints_beside(run.problem, rest, run.candidates, run.weights, where, least, kinds):
                yield rest, trial


def setpoints_beside(
    problem: Problem,
    fit: Fit,
    candidates: Sequence[Candidate],
    weights: np.ndarray,
    where: str,
    least: float = 0.0,
    spared: set[str] | None = None,
) -> list[Trial]:
    """The set-points of a joint (or "", of all drives), one of each kind, that explain most beside a fit.

    Args:
        problem: the fitted windows.
        fit: beside what it is tried.
        candidates: among which the set-points of the place are.
        weights: (W,) of the windows.
        where: the joint.
        least: fall of the robust cost on all windows that it must exceed.
        spared: kinds that are not tried.
    """
    rule, clean = problem.thresholds.selection.proposals.setpoints, fit.clean(problem)
    usual = max(typical_power(clean), 1.0)
    open_ = [c for c in candidates if c.where == where and c.effect in SETPOINTS and c.effect not in (spared or ())]
    open_ = [c for c in open_ if not is_chosen(c, fit.chosen)]
    open_ = list({(c.effect, bool(c.shape_scale)): c for c in open_}.values())  # sizes are those of the series
    if not open_:
        return []
    off = (clean**2).mean(axis=1)
    if where:
        off = joint_chi_squares(problem, clean)[0][:, problem.plant.joints.index(where)]
    some = problem.part(np.sort(np.argsort(-off)[: rule.windows]))
    best: dict[str, tuple[float, np.ndarray, Candidate]] = {}
    for c in open_:
        gain, values = _sought(some, fit, c, usual)
        if gain > best.get(c.effect, (rule.least_gain_tried,))[0]:
            best[c.effect] = gain, values, c
    most = max((gain for gain, *_ in best.values()), default=0.0)
    found = [(values, c) for gain, values, c in best.values() if gain > rule.near * most]
    if not found:
        return []
    none, *others = problem.residual([fit.effects, *(_with(fit, c, values) for values, c in found)])
    least, left_over = max(rule.least_gain, least), LeftOver(problem, fit, weights)
    return [
        Trial(_own(c, values, rule.step), values, left_over.cost(after), left_over.left(fit.residual - after))
        for after, (values, c) in zip(others, found, strict=True)
        if falls(problem, none, after, usual).sum() > least
    ]


def _own(candidate: Candidate, values: np.ndarray, share: float) -> Candidate:
    """The candidate with a step of this `share` of its size: of a first step it may be many."""
    return replace(candidate, step=(share * float(values[0]), *candidate.step[1:]))


def _sought(some: Problem, fit: Fit, candidate: Candidate, usual: float) -> tuple[float, np.ndarray]:
    """The best of a candidate's series on some windows: its gain there and parameters (P,)."""
    rule, first = some.thresholds.selection.proposals.setpoints, candidate.start
    coarse = rough(e.effect for e in fit.effects)

    def begin(tried: Sequence[np.ndarray]) -> None:
        effects = [e for values in tried for e in _with(fit, candidate, values)]
        begin_setpoints(some.windows, setpoints_of(some.plant, effects))

    def gains(tried: Sequence[np.ndarray]) -> list[float]:
        begin(tried)
        models = [fit.effects, *(_with(fit, candidate, values) for values in tried)]
        none, *others = some.residual(models, coarse=coarse)
        return [float(falls(some, none, r, usual).sum()) for r in others]

    def gain_of(values: np.ndarray, size: float, speed: float = 1.0) -> float:
        return gains([_scaled(values, size, speed)])[0]

    speeds = rule.speeds if candidate.shape_scale else (1.0,)
    series = profile(gains, [_scaled(first, size, speed) for speed in speeds for size in rule.factors])
    values, gain = series.size, series.gain
    if gain <= 0:
        return gain, values
    for _ in speeds[: rule.turns]:
        begin([_scaled(values, f) for f in reachable(rule.finer)])
        size, gain = stepped(partial(gain_of, values), 1.0, gain, rule.finer)
        values = _scaled(values, size)
        if candidate.shape_scale:
            begin([_scaled(values, 1.0, f) for f in reachable(rule.finer)])
            speed, gain = stepped(partial(gain_of, values, 1.0), 1.0, gain, rule.finer)
            values = _scaled(values, 1.0, speed)
    return gain, values


def _scaled(values: np.ndarray, size: float, speed: float = 1.0) -> np.ndarray:
    """Parameters (P,) with the first times `size` and the second, if there is one, times `speed`."""
    return values * np.array([size, speed])[: len(values)]


def setpoint_trials(run: SearchState, tried: Sequence[Trial]) -> Asking[list[Trial]]:
    """Set-points that explain more than the best of the trials, where that leaves much and may stand for one.

    Each place is asked once, and again when something was found on it.
    """
    best = min(tried, key=lambda t: t.cost, default=None)
    if best is None or best.candidate.effect not in LIKE or best.cost < run.config.many * run.fit.residual.size:
        return []
    key = (SETPOINTS[0], best.candidate.where)
    if key in run.hopeless:
        return []
    yield Vain(*key)
    found = setpoints_beside(run.problem, run.fit, run.candidates, run.weights, best.candidate.where)
    return [trial for trial in found if trial.cost < best.cost]


def explains_more(run: SearchState, where: str, gain: float) -> bool:
    """Whether a set-point of a joint ("": of all, or of any that is far off) raises `criterion` by more than `gain`."""
    far = odd_joints(run.problem, run.fit.clean(run.problem))
    places = [where] if where else ["", *(joint for joint, _ in far)]
    for place in places:
        timing = [c for c in run.fit.chosen if c.where == place and c.effect in TIMING]
        rest = columns_without(run.problem, run.fit, timing)
        for trial in setpoints_beside(run.problem, rest, run.candidates, run.weights, place):
            chosen, start = (*rest.chosen, trial.candidate), np.concatenate((rest.values, trial.values))
            new = gauss_newton(run.problem, chosen, start, run.weights, iterations=2, coarse=True, known=run.fit)
            if criterion(run.problem, new) - criterion(run.problem, run.fit) > gain:
                return True
    return False


def _with(fit: Fit, candidate: Candidate, values: np.ndarray) -> list[Effect]:
    """The fit's effects and a set-point, not brought within the bounds of the candidate's own step."""
    return [*fit.effects, replace(candidate, step=(float(values[0]), *candidate.step[1:])).at(values)]
