"""The last question: is the corrected model worse than the declared one on windows that took no part in the fit?

Each effect had to pay there when it was accepted, but not all of what stands in the end is judged so: steps of encoders
are read off the logs, a last fit moves every value. A correction that makes things worse is withdrawn, with a note.
Here windows of 0.2 s are judged in units of their noise, in logarithms, so that a few that went far astray count
little; the error in radians after 1 s, which is reported, can be larger all the same. So of what is surely worse there
at some horizon and surely better at none (`report.gain_by_horizon.harms`), one after the other goes (`diagnose`).
"""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.comparison.paired_tests import logs
from bumblebee.diagnosis.estimation import cost_of
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.sim.effects import Effect


def is_worse(problem: Problem, before: Sequence[Effect], after: Sequence[Effect]) -> bool:
    """Whether the windows of `problem` are further off with `after`, beyond doubt and by more than a trifle.

    Each with numerical differences of its own taken out.
    """
    rule, sides = problem.thresholds.comparison.withdrawn, []
    for residual in problem.residual([before, after]):
        nuisance = cost_of(problem, residual, window_weights(residual))[1]
        sides.append(logs(residual - np.tensordot(nuisance, problem.nuisance, axes=1)))
    growth = sides[1] - sides[0]
    error = growth.std(ddof=1) / np.sqrt(len(growth)) if len(growth) > 1 else np.inf
    return bool(growth.mean() > max(rule.growth, rule.z * error))


def standing(
    problem: Problem, fitted: Sequence[Effect], read: Sequence[Effect]
) -> tuple[list[Effect], list[Effect], list[str]]:
    """Effects that may stand of those fitted and of those read off the logs; and notes on the rest.

    `problem` has windows that took no part in the fit, where there are any.
    """
    fitted, read, notes = list(fitted), list(read), []
    if read and is_worse(problem, fitted, [*fitted, *read]):
        notes.append(withdrawn(read, "validation windows"))
        read = []
    if fitted and is_worse(problem, read, [*fitted, *read]):
        notes.append(withdrawn(fitted, "validation windows"))
        fitted = []
    return fitted, read, notes


def withdrawn(effects: Sequence[Effect], where: str) -> str:
    """Note on effects that do not stand, for the error with them is larger on windows called `where`."""
    names = ", ".join(f"{e.effect} on {', '.join(e.where) or 'the whole robot'}" for e in effects)
    return f"withdrawn, for its error on the {where} was larger: {names}"
