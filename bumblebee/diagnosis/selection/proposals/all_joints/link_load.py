"""One link heavier than declared, asked by itself: a tool or a load that the model does not have.

A load at the end of an arm makes all its servos late and low, as gains of half would, and far from the declared model
no slope says which. Each link's mass is fitted alone, with its moments and without, then the best with its centre of
mass.
"""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, absent
from bumblebee.diagnosis.estimation import Fit, gauss_newton, levenberg_marquardt
from bumblebee.diagnosis.residuals import Problem, window_weights


def link_load(problem: Problem, candidates: Sequence[Candidate]) -> tuple[Fit, ...]:
    """The mass of the link that leaves least, with its moments and without, and that with its centre of mass.

    One that leaves little stands alone. None where no link takes away much of what the declared model leaves.
    """
    rule = problem.thresholds.selection.proposals.all_joints
    declared = gauss_newton(problem, (), (), window_weights(problem.residual([[]])[0]))
    masses = [c for c in candidates if c.effect == "link_mass"]
    fits = [levenberg_marquardt(problem, [c], absent([c]), rule.steps) for c in masses]
    fits = [fit for fit in fits if fit.values[0] > fit.chosen[0].nominal[0]]
    best = min(fits, key=lambda fit: fit.power(problem), default=declared)
    if best.power(problem) >= rule.load_leaves * declared.power(problem):
        return ()
    if best.power(problem) < rule.still_off:
        return (best,)
    where = best.chosen[0].where
    kinds = sorted((fit for fit in fits if fit.chosen[0].where == where), key=lambda fit: -fit.values[1])
    return (*kinds, *_with_centre(problem, best, candidates))


def _with_centre(problem: Problem, fit: Fit, candidates: Sequence[Candidate]) -> list[Fit]:
    """Fits with the centre of mass free, where there is one."""
    rule = problem.thresholds.selection.proposals.all_joints
    centres = [c for c in candidates if (c.effect, c.where) == ("link_com", fit.chosen[0].where)]
    values = [np.concatenate((fit.values, absent([c]))) for c in centres]
    return [levenberg_marquardt(problem, [*fit.chosen, c], v, rule.steps) for c, v in zip(centres, values, strict=True)]
