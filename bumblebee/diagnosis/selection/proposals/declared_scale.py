"""Strength, inertia and friction by one common factor: where data say nothing of it, the declared values stand.

A drive that is told torques moves a joint by torque over inertia. Twice the strength, twice the inertia and twice the
friction move it alike, unless gravity, a spring or a link that was weighed fixes the scale. Such a fit may lie anywhere
along the common factor, and each of its effects looks sure beside the others. So a fit with strengths is compared with
one at the declared strengths: friction less by the factor, inertias from the declared ones on, all refitted. It is
taken where it costs no more than an effect that is redundant.
"""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.estimation import Fit, gauss_newton
from bumblebee.diagnosis.selection.changes import Asking, Refitted
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.sim.effects import CATALOGUE

STRENGTH = "motor_strength"
_INERTIA = "kg"
_FORCE = "N"


def keep_declared_scale(run: SearchState) -> Asking[bool]:
    """Take the declared strengths of torque drives where the data do not speak against them; whether it did."""
    strong = [c for c in run.fit.chosen[run.given :] if c.effect == STRENGTH]
    if not run.problem.plant.torque_input or not strong or not _has_scale(run.fit, strong):
        return False
    factor = float(np.exp(np.mean([np.log(max(run.fit.of(c)[0], 1e-6)) for c in strong])))
    rest = run.fit.without(strong)
    start = np.concatenate([_rescaled(c, rest.of(c), factor) for c in rest.chosen])
    rule = run.problem.thresholds.selection.proposals.declared_scale
    fit = gauss_newton(run.problem, rest.chosen, start, run.weights, rule.iterations, coarse=True, known=run.fit)
    if fit.cost > run.fit.cost + run.bound**2:
        return False
    said = f"the declared strength of the drives fits as well as {factor:.3g} times it with scaled inertias; kept"
    yield Refitted(fit, said, pruned=True)
    return True


def _has_scale(fit: Fit, strong: Sequence[Candidate]) -> bool:
    """Whether anything else is fitted that a common factor would scale along."""
    return any(_kind(c, 0) for c in fit.chosen if c not in strong)


def _kind(candidate: Candidate, number: int) -> str:
    """Whether a parameter is an inertia, a force or torque (by its unit), or neither."""
    unit = CATALOGUE[candidate.effect].parameters[number].unit
    return _INERTIA if unit.startswith("kg") else _FORCE if unit.split(" ")[0] == "N" else ""


def _rescaled(candidate: Candidate, values: np.ndarray, factor: float) -> np.ndarray:
    """Values (P,) less the common factor: forces by it, inertias as declared, others as they are."""
    kinds = [_kind(candidate, i) for i in range(len(values))]
    starts = {_INERTIA: np.array(candidate.nominal), _FORCE: np.asarray(values) / factor, "": np.asarray(values)}
    return np.array([starts[kind][i] for i, kind in enumerate(kinds)])
