"""Which basis functions the remaining torques follow: forward selection over all joints, each given those before."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from bumblebee.diagnosis.discrepancy.regressors import Quantities
from bumblebee.diagnosis.discrepancy.term_library import BasisFunction, basis_functions
from bumblebee.diagnosis.discrepancy.torque_scores import Evidence, Verdict
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.thresholds.discrepancy import StepwiseRegression


@dataclass(frozen=True, eq=False)
class Found:
    """One basis function on one joint."""

    joint: int
    function: BasisFunction
    torque: np.ndarray
    """(F, W, S) for coefficient 1."""
    verdict: Verdict
    """Given the basis functions before it."""


@dataclass(frozen=True, eq=False)
class Sought:
    """The basis functions that were found, in their order, and what they leave."""

    found: list[Found]
    evidence: Evidence
    bound: float
    """z that a basis function had to reach."""
    rivals: list[Found]
    """Rivals of the first basis function: they explain much of what it does and depend on something else."""


@dataclass(frozen=True, eq=False)
class Library:
    """All basis functions of all joints with their torques on some windows."""

    data: Quantities
    functions: list[list[BasisFunction]]
    torque: list[np.ndarray]
    """By joint: (E, W, S) of all basis functions' terms, one after the other, float32."""
    rows: list[list[slice]]

    @property
    def count(self) -> int:
        """How many basis functions there are."""
        return sum(len(functions) for functions in self.functions)


def library(data: Quantities, joints: Sequence[int]) -> Library:
    """The basis functions of `joints` (indices), others get none."""
    functions: list[list[BasisFunction]] = [[] for _ in data.joints]
    torque: list[np.ndarray] = [np.zeros((0, *data.path.mean(data.t).shape)) for _ in data.joints]
    rows: list[list[slice]] = [[] for _ in data.joints]
    for j in joints:
        kept, parts, at = [], [], 0
        for function in basis_functions(data, j):
            part = function.torque(data, j)
            if np.isfinite(part).all():
                kept.append(function)
                parts.append(part.astype(np.float32))
                rows[j].append(slice(at, at + len(part)))
                at += len(part)
        functions[j], torque[j] = kept, np.concatenate(parts)
    return Library(data, functions, torque, rows)


def seek(problem: Problem, evidence: Evidence, residual: np.ndarray, columns: np.ndarray, some: Library,
         most: int | None = None) -> Sought:  # fmt: skip
    """Basis functions that explain what `residual` (W, M) holds conditional on `columns` (F, W, M) of what was found.

    At most `most` of them; None for as many as the thresholds allow.
    """
    rule = problem.thresholds.discrepancy.stepwise_regression
    most = rule.most if most is None else most
    bound = float(norm.isf(rule.level / (2 * max(some.count, 1))))
    found: list[Found] = []
    rivals: list[Found] = []
    while len(found) < most:
        seen = _seen(evidence, some, found, bound)
        if not seen:
            # What acts in few windows, as a limit of speed does, decides the weights of just these: weigh all alike.
            seen = _seen(evidence.unweighted(problem, residual, columns), some, found, bound)
        if not seen:
            break
        one = _simplest(seen, rule)
        if not found:
            rivals = _rivals(one, seen, rule)
        found.append(one)
        columns = np.concatenate((columns, evidence.column(one.joint, one.torque)))
        evidence = evidence.with_columns(problem, residual, columns)
    return Sought(found, evidence, bound, rivals)


def _seen(evidence: Evidence, some: Library, found: Sequence[Found], bound: float) -> list[Found]:
    """The basis functions that explain most for their coefficients and are beyond doubt."""
    rule = some.data.thresholds.stepwise_regression
    least = rule.least_share * float((evidence.weights[:, None] * evidence.left**2).sum()) / max(evidence.spread, 1.0)
    taken = {(f.joint, text) for f in found for text in f.function.texts}
    best: list[tuple[float, int, BasisFunction]] = []
    for j, functions in enumerate(some.functions):
        if not functions:
            continue
        worth = evidence.gains(j, some.torque[j], some.rows[j])
        worth = worth - [rule.coefficient_price * len(function.texts) for function in functions]
        kinds: dict[tuple[str, ...], int] = {}
        for k in np.argsort(-worth):
            on = functions[k].on
            if worth[k] <= 0 or kinds.get(on, 0) >= rule.of_one_kind or sum(kinds.values()) >= rule.looked_at:
                continue
            if (j, functions[k].texts[0]) not in taken:
                kinds[on] = kinds.get(on, 0) + 1
                best.append((float(worth[k]), j, functions[k]))
    best.sort(key=lambda b: -b[0])
    seen = [
        (closer if k < rule.refined else _at)(evidence, some.data, j, function)
        for k, (_, j, function) in enumerate(best[: rule.looked_at])
    ]
    return [f for f in seen if f.verdict.z >= bound and f.verdict.gain >= least]


def _rivals(one: Found, seen: Sequence[Found], rule: StepwiseRegression) -> list[Found]:
    """The best of every other kind of dependence on the same joint; a formula beside a table is one, too."""
    kinds: dict[tuple[tuple[str, ...], bool], Found] = {(one.function.on, one.function.table): one}
    for f in sorted(seen, key=lambda f: _worth(f, rule), reverse=True):
        if f.joint == one.joint and _worth(f, rule) > rule.rival * _worth(one, rule):
            kinds.setdefault((f.function.on, f.function.table), f)
    return list(kinds.values())[1 : 1 + rule.rivals]


def _simplest(seen: Sequence[Found], rule: StepwiseRegression) -> Found:
    """The best; of several on its joint that do about the same, the simplest."""
    top = max(seen, key=lambda f: _worth(f, rule))
    least = _worth(top, rule) - max(rule.tie, rule.tie_share * top.verdict.gain)
    near = [f for f in seen if f.joint == top.joint and _worth(f, rule) > least]
    return min(near, key=lambda f: (f.function.cost, -f.verdict.gain))


def closest(evidence: Evidence, some: Library, joint: int, least: float) -> Found | None:
    """The basis function that explains most on one joint, however little, if its z reaches `least`."""
    if not some.functions[joint]:
        return None
    rule = some.data.thresholds.stepwise_regression
    worth = evidence.gains(joint, some.torque[joint], some.rows[joint])
    worth = worth - [rule.coefficient_price * len(function.texts) for function in some.functions[joint]]
    top = [_at(evidence, some.data, joint, some.functions[joint][k]) for k in np.argsort(-worth)[: rule.looked_at]]
    return max((f for f in top if f.verdict.z >= least), key=lambda f: _worth(f, rule), default=None)


def _worth(found: Found, rule: StepwiseRegression) -> float:
    return found.verdict.gain - rule.coefficient_price * len(found.function.texts)


def closer(evidence: Evidence, data: Quantities, joint: int, function: BasisFunction) -> Found:
    """The basis function at its best inner number; a whole number where that is as good."""
    best, rule = _at(evidence, data, joint, function), data.thresholds.stepwise_regression
    if function.family is None:
        return best
    reach = function.reach
    for _ in range(rule.refinement_rounds):
        for at in best.function.at + reach * np.linspace(-1, 1, rule.refinement):
            if at > 0 or function.at <= 0:
                best = max(best, _at(evidence, data, joint, function.moved(float(at))), key=lambda f: f.verdict.gain)
        reach /= rule.narrowing
    if function.at >= 1 and function.at == round(function.at):
        whole = _at(evidence, data, joint, function.moved(float(max(round(best.function.at), 1))))
        if whole.verdict.gain > best.verdict.gain - rule.tie:
            return whole
    return best


def _at(evidence: Evidence, data: Quantities, joint: int, function: BasisFunction) -> Found:
    torque = function.torque(data, joint)
    return Found(joint, function, torque, evidence.test(joint, torque))
