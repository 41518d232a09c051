"""A swap of several effects for one basis function: does that explain a joint better than the effects on it do?

The catalogue comes first, so a strange effect may stand as two or three of its effects that together come near it: a
tendon that is slack on one side as a spring and a little cogging. Then nothing is left to flag. The sign is a single
basis function, with no more numbers, that explains the joint better than all of them, on windows that took no part in
either fit.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, Formula, effects_at
from bumblebee.diagnosis.comparison import numbers_of
from bumblebee.diagnosis.discrepancy.missing_torque import Scene
from bumblebee.diagnosis.discrepancy.stepwise_regression import Found, Library, closer, library
from bumblebee.diagnosis.discrepancy.term_library import BasisFunction
from bumblebee.diagnosis.discrepancy.torque_scores import Evidence
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.residuals import Problem


def groups(fit: Fit, joint: str, most: int) -> Iterator[tuple[Candidate, ...]]:
    """The catalogue's effects on a joint in every combination, all of them first; of more than `most` all alone."""
    own = [c for c in fit.chosen if c.where == joint and not isinstance(c, Formula)]
    least = len(own) - 1 if len(own) > most else 0
    for count in range(len(own), least, -1):
        yield from combinations(own, count)


def single_functions(
    problem: Problem, fit: Fit, scene: Scene, some: Library, joint: str
) -> Iterator[tuple[tuple[Candidate, ...], Found]]:
    """Effects on a joint with a strange basis function that, to first order, explains as much with no more numbers.

    Args:
        problem: the fitted windows.
        fit: with the effects.
        scene: of `fit`.
        some: basis functions of the joints on these windows; those of `joint` are made where it has none.
        joint: name of the joint.
    """
    j = problem.plant.joints.index(joint)
    for gone in groups(fit, joint, problem.thresholds.discrepancy.single_law.most_effects):
        if not some.functions[j]:
            some = library(scene.data, [j])
        evidence, worth = _without(problem, fit, scene, gone)
        best = _best(evidence, some, j, worth, sum(numbers_of(c) for c in gone))
        if best is not None:
            yield gone, best


def _without(problem: Problem, fit: Fit, scene: Scene, gone: Sequence[Candidate]) -> tuple[Evidence, float]:
    """Evidence on what the windows lack without some effects, and what these gain, in its units."""
    keep, at = [], 0
    for c in fit.chosen:
        count = int(np.count_nonzero(c.scales))
        keep += [] if c in gone else list(range(at, at + count))
        at += count
    rest = [c for c in fit.chosen if c not in gone]
    values = np.concatenate([fit.of(c) for c in rest]) if rest else np.empty(0)
    residual = problem.residual([effects_at(rest, values)])[0]
    evidence = scene.evidence.with_columns(problem, residual, fit.columns[keep])
    left = ((evidence.left**2) - (fit.clean(problem) ** 2)).sum(axis=1)
    return evidence, float((evidence.weights * left).sum()) / max(evidence.spread, 1.0)


def _best(evidence: Evidence, some: Library, joint: int, worth: float, most: int) -> Found | None:
    """The strange basis function on a joint that explains most, if as much as `worth`; `most` numbers at most."""
    functions, rule = some.functions[joint], some.data.thresholds.single_law
    gains = evidence.gains(joint, some.torque[joint], some.rows[joint])
    fits = np.array([not f.effect and not f.table and _count(f) <= most for f in functions])
    gains = np.where(fits, gains, 0.0)
    order = [k for k in np.argsort(-gains)[: rule.refined] if gains[k] > rule.near * worth]
    found = [closer(evidence, some.data, joint, functions[k]) for k in order]
    found = [f for f in found if f.verdict.gain > worth]
    return max(found, key=lambda f: f.verdict.gain, default=None)


def _count(function: BasisFunction) -> int:
    """Numbers of a basis function that are found in the data."""
    return len(function.texts) + bool(function.family)
