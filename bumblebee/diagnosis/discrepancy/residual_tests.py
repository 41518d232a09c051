"""Residual of a fit, joint by joint: how much is unexplained, on what it depends, by which basis function; or nothing.

Two tests, both on the fitted windows and again on the validation set. Basis functions: whether one of several thousand,
each with its few coefficients, explains what is left (`stepwise_regression`). Lack of fit: whether the torques that a
joint lacks, free in every fifth of every window, are larger than sensor noise makes them; it sees what no basis
function follows. A third says whether the windows as a whole are further off than noise makes them: no joint need lack
a torque for that.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from bumblebee.diagnosis.comparison import confirmed as is_confirmed
from bumblebee.diagnosis.discrepancy.missing_torque import Scene, fitted_scene, validation_scene
from bumblebee.diagnosis.discrepancy.stepwise_regression import Found, Library, Sought, closest, library, seek
from bumblebee.diagnosis.discrepancy.term_library import BasisFunction
from bumblebee.diagnosis.estimation import Fit, solve
from bumblebee.diagnosis.residuals import Problem


@dataclass(frozen=True, eq=False)
class JointActivity:
    """Activity of J joints in the logs, before any test."""

    typical: np.ndarray
    """(J,) RMS torques of their servos [N m]."""
    still: Sequence[str] = ()
    """Joints that never move."""


@dataclass(frozen=True)
class JointLackOfFit:
    """Lack of fit of one joint."""

    joint: str
    p: float
    """p-value of the surer test, shared among all basis functions or joints."""
    excess: float
    """Standard errors by which its torques are larger than noise makes them."""
    functions: tuple[tuple[BasisFunction, np.ndarray], ...]
    """Basis functions with their sizes, each confirmed on the validation set."""
    rms: float
    """RMS torque of the basis functions [N m]; without any, what the excess stands for."""
    typical: float
    """RMS torque of the joint's servo [N m]."""
    depends_on: tuple[str, ...]
    """Quantities of `term_library.QUANTITIES` and "another joint (NAME)", the most important first."""
    significant: bool


@dataclass(frozen=True)
class Whole:
    """Lack of fit of all joints and sensors together."""

    reduced_chi_square: float
    """Mean square of what is left on the fitted windows, 1 for noise, each rollout's loudest windows not counted."""
    z: float
    """Standard errors by which that, with the validation set where there is one, is more than noise."""
    significant: bool


@dataclass(frozen=True, eq=False)
class LackOfFit:
    """Lack of fit of all joints."""

    joints: list[JointLackOfFit]
    scene: Scene
    validation: Scene | None
    sought: Sought
    library: Library
    """The basis functions that were tried on the fitted windows."""
    whole: Whole

    def worst(self, besides: Sequence[str] = ()) -> JointLackOfFit | None:
        """The joint with most that is significant, those in `besides` left out."""
        some = [j for j in self.joints if j.significant and j.joint not in besides]
        return max(some, key=lambda j: (j.excess, j.rms / j.typical), default=None)


@dataclass(frozen=True, eq=False)
class _Tested:
    """Outcome of the tests of all joints, before it is said of each."""

    scene: Scene
    excess: np.ndarray
    """(J,) standard errors of the joints' chi-square on the fitted windows."""
    confirmation: np.ndarray | None
    """(J,) the same on the validation set; None if there is none."""
    sought: Sought
    library: Library
    kept: list[tuple[Found, np.ndarray]]
    """Basis functions that were confirmed, with their sizes."""
    whole: Whole
    activity: JointActivity


def lack_of_fit(problem: Problem, validation: Problem | None, fit: Fit, activity: JointActivity) -> LackOfFit:
    """Test what `fit` leaves.

    Args:
        problem: the fitted windows.
        validation: windows that took no part; None if there are none.
        fit: of the effects found so far.
        activity: of the joints.
    """
    rule, names = problem.thresholds.discrepancy.residual_tests, problem.plant.joints
    # Where a foot tips one window holds more than all others: on a base that can fall the loudest do not count.
    spared = rule.loudest if problem.plant.floating else 0
    scene = fitted_scene(problem, fit, activity.typical)
    excess, confirmation, unseen = scene.excess(spared), None, None
    moving = [j for j in np.argsort(-excess) if names[j] not in activity.still][: rule.joints]
    some = library(scene.data, moving)
    sought = seek(problem, scene.evidence, scene.residual, scene.columns, some)
    if validation is not None:  # of what is not seen in the fitted windows nothing need be simulated in others
        asked = sorted({*np.flatnonzero(excess > rule.excess_fitted).tolist(), *(one.joint for one in sought.found)})
        unseen = validation_scene(validation, fit, activity.typical, asked)
        confirmation = unseen.excess(spared) if asked else np.zeros_like(excess)
    kept, whole = confirmed(scene, sought, unseen), in_whole(scene, unseen)
    tested = _Tested(scene, excess, confirmation, sought, some, kept, whole, activity)
    joints = [_of_joint(tested, j) for j in range(len(names))]
    return LackOfFit(joints, scene, unseen, sought, some, whole)


def _of_joint(tested: _Tested, j: int) -> JointLackOfFit:
    """Lack of fit of the joint with index `j`, from the tests."""
    scene, names, activity = tested.scene, tested.scene.problem.plant.joints, tested.activity
    rule = scene.problem.thresholds.discrepancy.residual_tests
    own = [(one, size) for one, size in tested.kept if one.joint == j]
    lacks = [np.einsum("fws,f->ws", one.torque, size) for one, size in own]
    rms = float(np.sqrt((np.sum(lacks, axis=0) ** 2).mean())) if own else scene.evidence.implied(j)
    loud = _is_loud(tested, j, rms)
    real = bool(own) and rms > rule.least_torque * activity.typical[j]
    p = [2 * norm.sf(one.verdict.z) * tested.library.count for one, _ in own]
    p.append(float(norm.sf(tested.excess[j])) * len(names))
    return JointLackOfFit(
        joint=names[j],
        p=float(min(1.0, *p)),
        excess=float(tested.excess[j]),
        functions=tuple((one.function, size) for one, size in own),
        rms=rms,
        typical=float(activity.typical[j]),
        depends_on=_depends_on(tested, j, loud),
        significant=bool(real or (loud and names[j] not in activity.still)),
    )


def _is_loud(tested: _Tested, j: int, rms: float) -> bool:
    """Whether the torques that a joint lacks, `rms` [N m], are larger than noise and other integrators make them."""
    rule, again = tested.scene.problem.thresholds.discrepancy.residual_tests, tested.confirmation
    more = rms > rule.slight_torque * tested.activity.typical[j]
    if not tested.excess[j] > (rule.excess_alone if again is None else rule.excess_fitted):
        return False
    if again is not None and not (again[j] > rule.excess_validation or _in_several(tested.scene, j, more)):
        return False
    return bool(more or tested.whole.significant)


def _depends_on(tested: _Tested, j: int, loud: bool) -> tuple[str, ...]:
    """Quantities of a joint's basis functions; if it is `loud` without any, of those that are nearest."""
    on = dict.fromkeys(quantity for one, _ in tested.kept if one.joint == j for quantity in one.function.on)
    if loud and not on:
        on = dict.fromkeys(q for one in tested.sought.found if one.joint == j for q in one.function.on)
    if loud and not on:
        least = tested.scene.problem.thresholds.discrepancy.residual_tests.hint
        hint = closest(tested.sought.evidence, tested.library, j, least)
        return tuple(hint.function.on) if hint is not None else ()
    return tuple(on)


def in_whole(scene: Scene, validation: Scene | None) -> Whole:
    """Whether the windows are further off than noise makes them; never in contact, where whitening is not that sure."""
    rule = scene.problem.thresholds.discrepancy.residual_tests
    value, error = scene.reduced_chi_square(rule.loudest)
    z, least = [(value - 1) / error], rule.whole_alone
    if validation is not None:
        again, error = validation.reduced_chi_square(rule.loudest)
        z.append((again - 1) / error)
        least = rule.whole_both
    both = float(np.sum(z) / np.sqrt(len(z)))
    return Whole(value, both, min(z) > rule.whole_each and both > least and not scene.problem.plant.floating)


def _in_several(scene: Scene, joint: int, much: bool) -> bool:
    """Whether a joint's chi-square is too large in each of several rollouts: what one shows may be an accident.

    So may what a rollout's loudest windows show: where a foot tips, one of them holds more than all others. A base that
    cannot fall has no such accidents: there one rollout does that shows very much in many windows, if it is `much`.
    """
    rule, rollouts = scene.problem.thresholds.discrepancy.residual_tests, np.unique(scene.problem.windows.rollout)
    excess = [scene.quiet_excess(joint, rule.loudest, [i]) for i in rollouts]
    if much and not scene.problem.plant.floating and max(excess) > rule.excess_one_rollout:
        return True
    return sum(e > rule.excess_fitted for e in excess) >= rule.rollouts


def confirmed(scene: Scene, sought: Sought, validation: Scene | None) -> list[tuple[Found, np.ndarray]]:
    """The basis functions with their sizes, in the joint fit of all; each that the validation set is better with.

    Where there is none, or none that meets it, each half of the fitted windows must be better with what the other says.
    """
    rule, gain = scene.problem.thresholds.discrepancy.residual_tests, scene.problem.thresholds.comparison.confirmed
    evidence, found = sought.evidence, sought.found
    sizes = solve(evidence.basis, evidence.inverse, scene.residual, evidence.weights)
    sizes = sizes[len(sizes) - sum(len(one.torque) for one in found) :]
    kept, left, at = [], None if validation is None else validation.left.copy(), 0
    for one in found:
        size = sizes[at : at + len(one.torque)]
        at += len(one.torque)
        if validation is None and not _repeats(scene, one):
            continue
        if validation is not None and left is not None:
            moved = validation.evidence.column(one.joint, one.function.torque(validation.data, one.joint))
            change = np.tensordot(size, moved, axes=1)
            if not is_confirmed(left, left - change, gain) and (
                (change**2).sum() > rule.met or not _repeats(scene, one)
            ):
                continue
            left = left - change
        kept.append((one, size))
    return kept


def _repeats(scene: Scene, one: Found) -> bool:
    """Whether a basis function fitted to every other window gains on those between, both ways.

    That is for what the validation set never meets.
    """
    evidence, torque = scene.evidence, one.torque
    least = scene.problem.thresholds.discrepancy.residual_tests.half_gain
    own = np.einsum("fws,ws->wf", torque, evidence.score[one.joint])
    normal = np.einsum("fws,wst,gwt->wfg", torque, evidence.normal[one.joint], torque, optimize=True)
    halves = np.arange(len(own)) % 2 == 0
    for fitted in (halves, ~halves):
        size = np.linalg.lstsq(normal[fitted].sum(axis=0), own[fitted].sum(axis=0), rcond=None)[0]
        gain = 2 * size @ own[~fitted].sum(axis=0) - size @ normal[~fitted].sum(axis=0) @ size
        if gain < least * max(evidence.spread, 1.0):
            return False
    return True
