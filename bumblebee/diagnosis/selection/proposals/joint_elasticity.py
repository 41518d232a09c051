"""Shafts, tried at many stiffnesses on the few windows in which their joint is furthest off.

Behind a shaft a link swings. One a fifth too soft or too stiff soon swings out of step with the data, so the score at
one stiffness says nothing of another, and what the swing does on average passes for a lag, an old reading or a rotor.
A geometric series of stiffnesses tells: where a name of that kind stands on a joint (`diagnosis/exchange.py`), and
where nothing is worth a trial any more and a joint's own readings are further off than noise. Only the best of the
series is simulated on all windows.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, is_chosen
from bumblebee.diagnosis.estimation import Fit, LeftOver, typical_power
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.proposals.joint_misfit import falls, joint_chi_squares
from bumblebee.diagnosis.selection.trial import Trial
from bumblebee.diagnosis.simulation import Plant

KIND = "series_elasticity"
# What a shaft's swing passes for.
LIKE = ("torque_lag", "encoder_delay", "command_delay", "armature", "kp", "kd", "series_elasticity")
_JOINTS = 2  # tried where nothing else is worth a trial
_FEW, _SOME = 8, 16  # windows for the series; to refine the best of it
# Stiffnesses in units of the servo's: the first; where steps get finer; the last, by where the encoder is; the ratios.
_FIRST, _CLOSE, _LAST, _WIDE, _FINE = 110.0, 40.0, (3.0, 8.0), 1.18, 1.09
_NONE = 1e-4  # of the servo's compliance: as good as stiff
_DAMPING = 0.1  # of the critical one of the rotor on the shaft, tried first
_WORTH, _PART, _BETTER, _ALONE = 40.0, 15.0, 5, 0.5  # fall of the cost; on those tried; windows; share one may have
_STEP = 0.2  # of the compliance: five times what sensitivities are differences of
_UNEASY, _MOST = 3.0, 4.0  # standard errors by which a joint must be off; times noise a window counts at most


def shaft_trials(
    problem: Problem, fit: Fit, candidates: Sequence[Candidate], weights: np.ndarray, hopeless: set[tuple[str, str]]
) -> list[Trial]:
    """The shaft that explains most on one of the joints that are furthest off; none where none does.

    Each joint is tried once and joins the `hopeless`.
    """
    clean = fit.clean(problem)
    own, freedom = joint_chi_squares(problem, clean)
    own = np.minimum(own / max(typical_power(clean), 1.0), _MOST * freedom)  # a contact spoils a few windows
    off = (own - freedom).sum(axis=0) / np.sqrt(2.0 * freedom * len(own))
    for j in np.argsort(-off)[:_JOINTS]:
        where = problem.plant.joints[j]
        if off[j] < _UNEASY or (KIND, where) in hopeless:
            continue
        hopeless.add((KIND, where))
        best = best_shaft(problem, fit, candidates, weights, where)
        if best:
            return [best]
    return []


def best_shaft(
    problem: Problem, fit: Fit, candidates: Sequence[Candidate], weights: np.ndarray, where: str, least: float = 0.0
) -> Trial | None:
    """The shaft on a joint that explains most, the encoder on either side, or None.

    `least` is the fall of the robust cost on all windows that it must exceed.
    """
    clean = fit.clean(problem)
    usual = max(typical_power(clean), 1.0)
    chi, _ = joint_chi_squares(problem, clean)
    odd = np.argsort(-chi[:, problem.plant.joints.index(where)])
    few, some = (problem.part(np.sort(odd[:count])) for count in (_FEW, _SOME))
    kinds = [c for c in candidates if (c.effect, c.where) == (KIND, where) and not is_chosen(c, fit.chosen)]
    found = [(*_sought(few, some, fit, c, usual), c) for c in kinds]
    if not found:
        return None
    gain, values, c = max(found, key=lambda f: f[0])
    if gain < _PART:
        return None
    none, after = problem.residual([_with(fit, c, _stiff(problem.plant, c)), _with(fit, c, values)])
    each = falls(problem, none, after, usual)
    if each.sum() < max(_WORTH, least) or (each > 0).sum() < _BETTER or each.max() > _ALONE * each.sum():
        return None
    beside = LeftOver(problem, fit, weights)
    own = replace(c, step=(_STEP * float(values[0]), *c.step[1:]))
    return Trial(own, values, beside.cost(after), beside.left(fit.residual - after))


def is_of_series(candidate: Candidate, values: np.ndarray) -> bool:
    """Whether a chosen effect with parameters `values` (P,) is a shaft that was found here, and near where it was."""
    return candidate.effect == KIND and 0.5 < values[0] * _STEP / candidate.step[0] < 2.0


def _sought(few: Problem, some: Problem, fit: Fit, candidate: Candidate, usual: float) -> tuple[float, np.ndarray]:
    """The best of the series on the `few` windows, refined on `some`: its gain there and parameters (P,)."""
    plant = some.plant
    soft = 1.0 / _servo(plant, candidate.where)
    rotor = float(plant.model.dof_armature[plant.dof[plant.joints.index(candidate.where)]])

    def at(compliance: float) -> np.ndarray:
        values = candidate.start
        values[0], values[2] = compliance, 2 * _DAMPING * np.sqrt(rotor * compliance) or values[2]
        return values

    def best_of(problem: Problem, tried: Sequence[np.ndarray]) -> tuple[float, np.ndarray]:
        none, *others = problem.residual([_with(fit, candidate, v) for v in (_stiff(plant, candidate), *tried)])
        worth = [float(falls(problem, none, r, usual).sum()) for r in others]
        k = int(np.argmax(worth))
        return worth[k], tried[k]

    best = best_of(few, [at(soft / stiffness) for stiffness in series(bool(candidate.step[1]))])
    if best[0] < 0:
        return best
    best = best_of(some, [best[1]])
    for ratio in (_FINE**0.5, _FINE**0.25):
        factors = [(ratio, 1.0), (1 / ratio, 1.0), (1.0, 0.6), (1.0, 1.7)]  # on compliance and loss
        near = [best[1] * np.array([a, 1.0, b, 1.0]) for a, b in factors]
        best = max(best, best_of(some, near), key=lambda f: f[0])
    return best


def series(on_joint: bool) -> np.ndarray:
    """Stiffnesses (K,) that are tried, in units of the servo's, by where the encoder is.

    Behind a soft shaft a servo that reads the joint shakes it; shortly before it does, the swing lasts long.
    """
    wide = np.geomspace(_FIRST, _CLOSE, round(np.log(_FIRST / _CLOSE) / np.log(_WIDE)), endpoint=False)
    last = _LAST[int(on_joint)]
    ratio = _FINE if on_joint else _WIDE
    return np.concatenate((wide, np.geomspace(_CLOSE, last, round(np.log(_CLOSE / last) / np.log(ratio)) + 1)))


def _servo(plant: Plant, where: str) -> float:
    """Stiffness [N m/rad] of a joint's servo; of a drive that has none, 1."""
    a = plant.actuator[plant.joints.index(where)]
    return abs(float(plant.model.actuator_gear[a, 0] ** 2 * plant.model.actuator_biasprm[a, 1])) or 1.0


def _stiff(plant: Plant, candidate: Candidate) -> np.ndarray:
    """Parameters (P,) of a shaft as good as stiff: with the encoder on the joint servos are integrated otherwise."""
    values = candidate.start
    values[0] = _NONE / _servo(plant, candidate.where)
    return values


def _with(fit: Fit, candidate: Candidate, values: np.ndarray) -> list:
    """The fit's effects and a shaft, not brought within the bounds of the candidate's own step."""
    return [*fit.effects, replace(candidate, step=(float(values[0]), *candidate.step[1:])).at(values)]
