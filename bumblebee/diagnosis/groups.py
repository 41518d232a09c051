"""Several effects at once, where many are wrong: what the slopes say is lacking beside each other, accepted together.

One by one, each of twenty effects costs a screening, trials and a refit of all that came before it. Where many were
fitted together (`many`) the model is near enough for slopes: the best candidate is taken for found, the others are
tested beside it, and so on, without a simulation. All are then fitted together in the simulator. Those that are sure
there are kept if they pay together on windows that took no part.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.acceptance import wald
from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.eligible import is_chosen
from bumblebee.diagnosis.fit import Fit, gauss_newton, project, solve
from bumblebee.diagnosis.many import BODIES, KINDS, without_some
from bumblebee.diagnosis.problem import Problem, window_weights
from bumblebee.diagnosis.scores import Columns, Scores, score_tests

_KINDS = (*KINDS, *BODIES, "kp", "kd", "command_delay", "link_inertia", "joint_spring", "asymmetric_friction")
_MOST = 8

IsOpen = Callable[[Candidate, Scores, int], bool]


def beside_each_other(
    problem: Problem, columns: Columns, fit: Fit, weights: np.ndarray, is_open: IsOpen
) -> list[tuple[Candidate, np.ndarray]]:
    """Candidates of `columns` that are worth a trial beside each other, with values (P,), the best first.

    `fit` and `weights` are on the windows of `problem`, those of a screening.
    """
    picked: list[Candidate] = []
    rows = columns.slices
    basis, count = fit.columns, len(problem.nuisance) + len(fit.columns)
    while len(picked) < _MOST:
        tests = score_tests(problem, columns, replace(fit, columns=basis), weights)
        best = next((k for k in np.argsort(-tests.gain) if _may(columns, tests, int(k), fit, picked, is_open)), None)
        if best is None:
            break
        picked.append(columns.candidates[best])
        basis = np.concatenate((basis, columns.values[rows[best]]))
    every, inverse = project(problem, basis, weights)
    steps, found = solve(every, inverse, fit.residual, weights)[count:], []
    for c in picked:
        values = np.array(c.nominal)
        values[list(c.free)] += steps[: len(c.free)] * np.array(c.step)[list(c.free)]
        steps = steps[len(c.free) :]
        found.append((c, c.clip(values)))
    return found


def _may(columns: Columns, tests: Scores, k: int, fit: Fit, picked: Sequence[Candidate], is_open: IsOpen) -> bool:
    c = columns.candidates[k]
    return c.effect in _KINDS and not is_chosen(c, [*fit.chosen, *picked]) and is_open(c, tests, k)


def fitted_with(
    problem: Problem, fit: Fit, new: Sequence[tuple[Candidate, np.ndarray]], bound: float
) -> tuple[Fit, np.ndarray]:
    """A fit with those of some `new` effects that reach the z `bound` in it, and the weights (W,) of its windows."""
    chosen = (*fit.chosen, *(c for c, _ in new))
    values, known = np.concatenate((fit.values, *(v for _, v in new))), fit
    weights = window_weights(fit.clean(problem))
    while len(chosen) > len(fit.chosen):
        known = gauss_newton(problem, chosen, values, weights, iterations=2, coarse=True, known=known)
        weights = window_weights(known.clean(problem))
        less = known
        while len(less.chosen) > len(fit.chosen):
            z = [wald(problem, less, weights, k) for k in range(len(fit.chosen), len(less.chosen))]
            least = int(np.argmin(z))
            if z[least] >= bound:
                break
            less = without_some(problem, less, weights, {len(fit.chosen) + least})
        if less.chosen == chosen:
            return known, weights
        chosen, values = less.chosen, less.values
    return fit, weights
