"""What a fit leaves unexplained, joint by joint: how much, on what it depends, by which law; or nothing.

Two tests, both on the fitted windows and again on those that took no part in the fit. Laws: whether one of several
thousand, each with its few coefficients, explains what is left (`diagnosis/seek.py`). Power: whether the torques that a
joint lacks, free in every fifth of every window, are larger than sensor noise makes them; it sees what no law names.
A third says whether the windows as a whole are further off than noise makes them: no joint need lack a torque for that.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from bumblebee.diagnosis.comparison import better
from bumblebee.diagnosis.discrepancy.missing_torque import Scene, fitted_scene, judged_scene
from bumblebee.diagnosis.discrepancy.stepwise_regression import Found, Library, Sought, closest, library, seek
from bumblebee.diagnosis.discrepancy.term_library import Law
from bumblebee.diagnosis.estimation import Fit, solve
from bumblebee.diagnosis.residuals import Problem


@dataclass(frozen=True)
class JointRemains:
    """What is left in one joint."""

    joint: str
    p: float
    """Of the surer test, shared among all laws or joints."""
    excess: float
    """Standard errors by which its torques are larger than noise makes them."""
    laws: tuple[tuple[Law, np.ndarray], ...]
    """Laws with their sizes, each confirmed on the judging windows."""
    rms: float
    """RMS torque of the laws [N m]; without any, what the excess stands for."""
    typical: float
    """RMS torque of the joint's servo [N m]."""
    depends_on: tuple[str, ...]
    """Quantities of `laws.QUANTITIES` and "another joint (NAME)", the most important first."""
    significant: bool


@dataclass(frozen=True)
class Whole:
    """Of all joints and sensors together."""

    power: float
    """Mean square of what is left on the fitted windows, 1 for noise, each rollout's loudest windows not counted."""
    z: float
    """Standard errors by which that, with the judging windows where there are any, is more than noise."""
    significant: bool


@dataclass(frozen=True, eq=False)
class Remains:
    """Of all joints."""

    joints: list[JointRemains]
    scene: Scene
    judged: Scene | None
    sought: Sought
    library: Library
    """The laws that were tried on the fitted windows."""
    whole: Whole

    def worst(self, beside: Sequence[str] = ()) -> JointRemains | None:
        """The joint with most that is significant, those in `beside` left out."""
        some = [j for j in self.joints if j.significant and j.joint not in beside]
        return max(some, key=lambda j: (j.excess, j.rms / j.typical), default=None)


def remains(
    problem: Problem, judge: Problem | None, fit: Fit, typical: np.ndarray, still: Sequence[str] = ()
) -> Remains:
    """Test what `fit` leaves.

    Args:
        problem: the fitted windows.
        judge: windows that took no part; None if there are none.
        fit: of the effects found so far.
        typical: (J,) RMS torques of the joints [N m].
        still: joints that never move.
    """
    rule = problem.thresholds.discrepancy.residual_tests
    # Where a foot tips one window holds more than all others: on a base that can fall the loudest do not count.
    spared = rule.loudest if problem.plant.floating else 0
    scene = fitted_scene(problem, fit, typical)
    excess, again, judged = scene.excess(spared), None, None
    names = problem.plant.joints
    moving = [j for j in np.argsort(-excess) if names[j] not in still][: rule.joints]
    some = library(scene.data, moving)
    sought = seek(problem, scene.evidence, scene.residual, scene.columns, some)
    if judge is not None:  # of what is not seen in the fitted windows nothing need be simulated in others
        asked = sorted({*np.flatnonzero(excess > rule.excess_fitted).tolist(), *(one.joint for one in sought.found)})
        judged = judged_scene(judge, fit, typical, asked)
        again = judged.excess(spared) if asked else np.zeros_like(excess)
    kept, whole = confirmed(scene, sought, judged), in_whole(scene, judged)
    found = []
    for j, name in enumerate(names):
        own = [(one, size) for one, size in kept if one.joint == j]
        lacks = [np.einsum("fws,f->ws", one.torque, size) for one, size in own]
        rms = float(np.sqrt((np.sum(lacks, axis=0) ** 2).mean())) if own else scene.evidence.implied(j)
        loud = excess[j] > (rule.excess_alone if again is None else rule.excess_fitted)
        more = rms > rule.slight_torque * typical[j]
        if again is not None:
            loud &= again[j] > rule.excess_validation or _in_two(scene, j, more)
        loud &= more or whole.significant
        real = bool(own) and rms > rule.least_torque * typical[j]
        p = [2 * norm.sf(one.verdict.z) * some.count for one, _ in own]
        p.append(float(norm.sf(excess[j])) * len(names))
        on = list(dict.fromkeys(quantity for one, _ in own for quantity in one.law.on))
        if loud and not on:
            on = list(dict.fromkeys(quantity for one in sought.found if one.joint == j for quantity in one.law.on))
        if loud and not on:
            hint = closest(sought.evidence, some, j, rule.hint)
            on = list(hint.law.on) if hint is not None else []
        found.append(
            JointRemains(
                name, float(min(1.0, *p)), float(excess[j]), tuple((one.law, size) for one, size in own), rms,
                float(typical[j]), tuple(on), bool(real or (loud and name not in still)),
            )
        )  # fmt: skip
    return Remains(found, scene, judged, sought, some, whole)


def in_whole(scene: Scene, judged: Scene | None) -> Whole:
    """Whether the windows are further off than noise makes them; never in contact, where whitening is not that sure."""
    rule = scene.problem.thresholds.discrepancy.residual_tests
    power, error = scene.power(rule.loudest)
    z, least = [(power - 1) / error], rule.whole_alone
    if judged is not None:
        again, error = judged.power(rule.loudest)
        z.append((again - 1) / error)
        least = rule.whole_both
    both = float(np.sum(z) / np.sqrt(len(z)))
    return Whole(power, both, min(z) > rule.whole_each and both > least and not scene.problem.plant.floating)


def _in_two(scene: Scene, joint: int, much: bool) -> bool:
    """Whether a joint's power is too large in each of two rollouts: what one rollout shows may be an accident.

    So may what a rollout's loudest windows show: where a foot tips, one of them holds more than all others. A base that
    cannot fall has no such accidents: there one rollout does that shows very much in many windows, if it is `much`.
    """
    rule, rollouts = scene.problem.thresholds.discrepancy.residual_tests, np.unique(scene.problem.windows.rollout)
    excess = [scene.quiet_excess(joint, rule.loudest, [i]) for i in rollouts]
    if much and not scene.problem.plant.floating and max(excess) > rule.excess_one_rollout:
        return True
    return sum(e > rule.excess_fitted for e in excess) >= rule.rollouts


def confirmed(scene: Scene, sought: Sought, judged: Scene | None) -> list[tuple[Found, np.ndarray]]:
    """The laws with their sizes, in the joint fit of all; each that the judging windows are better with.

    Where there are none, or none that meet it, each half of the fitted windows must be better with what the other says.
    """
    rule = scene.problem.thresholds.discrepancy.residual_tests
    evidence, found = sought.evidence, sought.found
    sizes = solve(evidence.basis, evidence.inverse, scene.residual, evidence.weights)
    sizes = sizes[len(sizes) - sum(len(one.torque) for one in found) :]
    kept, left, at = [], None if judged is None else judged.left.copy(), 0
    for one in found:
        size = sizes[at : at + len(one.torque)]
        at += len(one.torque)
        if judged is None and not _repeats(scene, one):
            continue
        if judged is not None:
            moved = judged.evidence.column(one.joint, one.law.torque(judged.data, one.joint))
            change = np.tensordot(size, moved, axes=1)
            if not better(left, left - change) and ((change**2).sum() > rule.met or not _repeats(scene, one)):
                continue
            left = left - change
        kept.append((one, size))
    return kept


def _repeats(scene: Scene, one: Found) -> bool:
    """Whether a law fitted to every other window pays on those between, both ways: what the judges never meet."""
    evidence, torque = scene.evidence, one.torque
    least = scene.problem.thresholds.discrepancy.residual_tests.half_gain
    own = np.einsum("fws,ws->wf", torque, evidence.score[one.joint])
    normal = np.einsum("fws,wst,gwt->wfg", torque, evidence.power[one.joint], torque, optimize=True)
    halves = np.arange(len(own)) % 2 == 0
    for fitted in (halves, ~halves):
        size = np.linalg.lstsq(normal[fitted].sum(axis=0), own[fitted].sum(axis=0), rcond=None)[0]
        gain = 2 * size @ own[~fitted].sum(axis=0) - size @ normal[~fitted].sum(axis=0) @ size
        if gain < least * max(evidence.spread, 1.0):
            return False
    return True
