"""The last step of a fit where the cost is rough: from the residuals on both sides of every parameter at once.

Where feet touch the floor a simulation jumps with the parameters: a foot that lands a step earlier changes one window
by more than a percent of an encoder's offset changes all. The cost along a parameter is a parabola with steps of tens
of chi-squares on it, and a descent stops in the first hollow: dry friction of 0.2733 N m stayed at 0.2655, four
standard errors off, because a tenth of the right step raised the cost by 82 where the whole step lowered it by 112. So
there the last step compares no costs. Slopes are central differences over a fifth of a change that matters, residuals
the mean over the points that these need, and the step is the least-squares solution.

Fits with a limit or a gap are left out of it: these act in few windows and from a size on, through which no plane
leads. A torque limit of 1.62 N m, which the search had found as 1.63, went to 2.47.
"""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.candidates import ABRUPT, SATURATIONS, Candidate, clipped, effects_at
from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.estimation.gauss_newton import gauss_newton
from bumblebee.diagnosis.estimation.least_squares import cost_of, project, solve
from bumblebee.diagnosis.residuals import Problem


def last_step(problem: Problem, chosen: Sequence[Candidate], values: np.ndarray, weights: np.ndarray) -> Fit:
    """The fit near `values` (P,), with columns around it; on a fixed base, or with a limit, by Gauss and Newton.

    Of no candidates it is the fit of the declared model.
    """
    if not chosen or not problem.plant.floating or any(c.effect in (*SATURATIONS, *ABRUPT) for c in chosen):
        return gauss_newton(problem, chosen, values, weights, iterations=1)
    rule = problem.thresholds.estimation.response_surface
    start = found = clipped(chosen, np.asarray(values, dtype=float))
    scales = np.concatenate([c.scales for c in chosen])
    moving, points, residuals = np.flatnonzero(scales), [], []
    for _ in range(rule.rounds):
        before, new = found, _around(chosen, found, rule.step * scales)
        points += new
        residuals += list(problem.residual([effects_at(chosen, there) for there in new]))
        columns, here = _plane((np.stack(points) - before)[:, moving] / scales[moving], np.stack(residuals))
        basis, inverse = project(problem, columns, weights)
        move = np.zeros(len(scales))
        move[moving] = solve(basis, inverse, here, weights)[len(problem.nuisance) :] * scales[moving]
        found = clipped(chosen, before + move)
        if len(moving) > rule.few and (np.abs(found - before) <= rule.step * scales).all():
            break
    residual = problem.residual([effects_at(chosen, found)])[0]
    cost, nuisance = cost_of(problem, residual, weights)
    if cost > max(cost_of(problem, r, weights)[0] for r in residuals):  # worse than all points on the way
        return gauss_newton(problem, chosen, start, weights, iterations=1)
    return Fit(tuple(chosen), found, nuisance, residual, columns, cost)


def _around(chosen: Sequence[Candidate], values: np.ndarray, steps: np.ndarray) -> list[np.ndarray]:
    """Values (P,) and those one of `steps` (P,) to either side of each fitted one, as far as the bounds let them."""
    points = [values]
    for i in np.flatnonzero(steps):
        for sign in (1.0, -1.0):
            there = values.copy()
            there[i] += sign * steps[i]
            points.append(clipped(chosen, there))
    return points


def _plane(away: np.ndarray, residuals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The plane through residuals (N, W, M) at the points `away` (N, P') by least squares.

    Returns columns (P', W, M), by which the prediction changes for 1, and the plane's residual (W, M) at 0.
    """
    middle = away.mean(axis=0)
    columns = -np.tensordot(np.linalg.pinv(away - middle), residuals, axes=1)
    return columns, residuals.mean(axis=0) + np.tensordot(middle, columns, axes=1)
