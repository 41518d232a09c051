"""Joint elasticity, tried at many stiffnesses on the few windows in which its joint is furthest off.

Behind an elastic joint a link swings. One a fifth too soft or too stiff soon swings out of step with the data, so the
score at one stiffness says nothing of another, and what the swing does on average passes for a lag, latency or rotor
inertia. A geometric series of stiffnesses tells: where an effect of that kind was found on a joint
(`selection/swap.py`), and where nothing is worth a trial any more and a joint's own readings are further off than
noise. Only the best of the series is simulated on all windows.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, is_chosen
from bumblebee.diagnosis.estimation import Fit, LeftOver, typical_power
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.changes import Asking, Vain
from bumblebee.diagnosis.selection.profile import profile
from bumblebee.diagnosis.selection.proposals.joint_misfit import falls, joint_chi_squares
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.trial import Trial
from bumblebee.diagnosis.simulation import Plant
from bumblebee.diagnosis.thresholds.proposals import JointElasticity

KIND = "series_elasticity"
# What the swing behind an elastic joint passes for.
LIKE = ("torque_lag", "encoder_delay", "command_delay", "armature", "kp", "kd", "series_elasticity")


def joint_elasticity_trials(run: SearchState) -> Asking[list[Trial]]:
    """The elasticity that explains most on one of the joints that are furthest off; none where none does.

    Each joint is tried once and then among the `hopeless`, (effect, joint).
    """
    problem, fit = run.problem, run.fit
    rule = problem.thresholds.selection.proposals.joint_elasticity
    clean = fit.clean(problem)
    own, freedom = joint_chi_squares(problem, clean)
    own = np.minimum(own / max(typical_power(clean), 1.0), rule.largest_power * freedom)
    off = (own - freedom).sum(axis=0) / np.sqrt(2.0 * freedom * len(own))
    for j in np.argsort(-off)[: rule.joints]:
        where = problem.plant.joints[j]
        if off[j] < rule.least_errors or (KIND, where) in run.hopeless:
            continue
        yield Vain(KIND, where)
        best = best_elasticity(problem, fit, run.candidates, run.weights, where)
        if best:
            return [best]
    return []


def best_elasticity(
    problem: Problem, fit: Fit, candidates: Sequence[Candidate], weights: np.ndarray, where: str, least: float = 0.0
) -> Trial | None:
    """The elasticity of a joint that explains most, the encoder on either side, or None.

    `least` is the fall of the robust cost on all windows that it must exceed.
    """
    rule = problem.thresholds.selection.proposals.joint_elasticity
    clean = fit.clean(problem)
    usual = max(typical_power(clean), 1.0)
    chi, _ = joint_chi_squares(problem, clean)
    odd = np.argsort(-chi[:, problem.plant.joints.index(where)])
    few, some = (problem.part(np.sort(odd[:count])) for count in (rule.series_windows, rule.refining_windows))
    kinds = [c for c in candidates if (c.effect, c.where) == (KIND, where) and not is_chosen(c, fit.chosen)]
    found = [(*_sought(few, some, fit, c, usual), c) for c in kinds]
    if not found:
        return None
    gain, values, c = max(found, key=lambda f: f[0])
    if gain < rule.least_gain_tried:
        return None
    none, after = problem.residual([_with(fit, c, _stiff(problem, c)), _with(fit, c, values)])
    each = falls(problem, none, after, usual)
    few = (each > 0).sum() < rule.better_windows
    if each.sum() < max(rule.least_gain, least) or few or each.max() > rule.largest_share * each.sum():
        return None
    left_over = LeftOver(problem, fit, weights)
    own = replace(c, step=(rule.step * float(values[0]), *c.step[1:]))
    return Trial(own, values, left_over.cost(after), left_over.left(fit.residual - after))


def is_of_series(problem: Problem, candidate: Candidate, values: np.ndarray) -> bool:
    """Whether a chosen effect with parameters `values` (P,) is elasticity found here, and near where it was."""
    rule = problem.thresholds.selection.proposals.joint_elasticity
    return candidate.effect == KIND and 1 / rule.near < values[0] * rule.step / candidate.step[0] < rule.near


def _sought(few: Problem, some: Problem, fit: Fit, candidate: Candidate, usual: float) -> tuple[float, np.ndarray]:
    """The best of the series on the `few` windows, refined on `some`: its gain there and parameters (P,)."""
    plant, rule = some.plant, some.thresholds.selection.proposals.joint_elasticity
    soft = 1.0 / _servo(plant, candidate.where)
    rotor = float(plant.model.dof_armature[plant.dof[plant.joints.index(candidate.where)]])

    def at(compliance: float) -> np.ndarray:
        values = candidate.start
        values[0], values[2] = compliance, 2 * rule.damping * np.sqrt(rotor * compliance) or values[2]
        return values

    def best_of(problem: Problem, tried: Sequence[np.ndarray]) -> tuple[float, np.ndarray]:
        def gains(tried: Sequence[np.ndarray]) -> list[float]:
            none, *others = problem.residual([_with(fit, candidate, v) for v in (_stiff(some, candidate), *tried)])
            return [float(falls(problem, none, r, usual).sum()) for r in others]

        found = profile(gains, tried)
        return found.gain, found.size

    best = best_of(few, [at(soft / stiffness) for stiffness in series(bool(candidate.step[1]), rule)])
    if best[0] < 0:
        return best
    best = best_of(some, [best[1]])
    for ratio in (rule.fine_ratio**0.5, rule.fine_ratio**0.25):
        factors = [(ratio, 1.0), (1 / ratio, 1.0), *((1.0, loss) for loss in rule.loss_factors)]  # compliance, loss
        near = [best[1] * np.array([a, 1.0, b, 1.0]) for a, b in factors]
        best = max(best, best_of(some, near), key=lambda f: f[0])
    return best


def series(on_joint: bool, rule: JointElasticity) -> np.ndarray:
    """Stiffnesses (K,) that are tried, in units of the servo's, by where the encoder is.

    Where it is soft, a servo that reads the joint shakes it; shortly before it does, the swing lasts long.
    """
    first, middle, last = rule.stiffest, rule.finer_below, rule.softest[int(on_joint)]
    wide = np.geomspace(first, middle, round(np.log(first / middle) / np.log(rule.wide_ratio)), endpoint=False)
    ratio = rule.fine_ratio if on_joint else rule.wide_ratio
    return np.concatenate((wide, np.geomspace(middle, last, round(np.log(middle / last) / np.log(ratio)) + 1)))


def _servo(plant: Plant, where: str) -> float:
    """Stiffness [N m/rad] of a joint's servo; of a drive that has none, 1."""
    a = plant.actuator[plant.joints.index(where)]
    return abs(float(plant.model.actuator_gear[a, 0] ** 2 * plant.model.actuator_biasprm[a, 1])) or 1.0


def _stiff(problem: Problem, candidate: Candidate) -> np.ndarray:
    """Parameters (P,) of a joint as good as stiff: with the encoder on the joint servos are integrated otherwise."""
    rule, values = problem.thresholds.selection.proposals.joint_elasticity, candidate.start
    values[0] = rule.none / _servo(problem.plant, candidate.where)
    return values


def _with(fit: Fit, candidate: Candidate, values: np.ndarray) -> list:
    """The fit's effects and an elastic joint, not brought within the bounds of the candidate's own step."""
    return [*fit.effects, replace(candidate, step=(float(values[0]), *candidate.step[1:])).at(values)]
