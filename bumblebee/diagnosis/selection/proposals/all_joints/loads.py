"""Links of a free base heavier or lighter than declared, asked by slopes beside the standard parameters of its joints.

A load on the trunk makes every joint below it late and low. Offsets, rotors and gains of all joints share it out, and
no single mass pays any more once these are taken for sure. So masses are asked before that: those that promise much
beside all joints' effects, and beside each other, are fitted with them.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, absent, is_chosen
from bumblebee.diagnosis.estimation import Fit, cost_of, levenberg_marquardt
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.diagnosis.selection.score_tests import score_tests
from bumblebee.diagnosis.sensitivities import Columns


def with_loads(problem: Problem, fit: Fit, candidates: Sequence[Candidate]) -> Fit:
    """The fit with the masses that take a share of its cost away, their moments along; the fit itself where none do."""
    rule = problem.thresholds.selection.proposals.all_joints
    weights = window_weights(fit.clean(problem))
    cost = cost_of(problem, fit.residual, weights)[0]
    loads = _promising(problem, fit, candidates, weights, rule.load_takes * cost)
    if not loads:
        return fit
    begun = (*fit.chosen, *loads), np.concatenate((fit.values, absent(loads)))
    loaded = levenberg_marquardt(problem, *begun, rule.steps_with_links)
    return loaded if cost_of(problem, loaded.residual, weights)[0] < (1 - rule.load_takes) * cost else fit


def _promising(
    problem: Problem, fit: Fit, candidates: Sequence[Candidate], weights: np.ndarray, least: float
) -> list[Candidate]:
    """Masses, best first, that each take at least so much cost away by slopes, beside the fit and those before them."""
    masses = [c for c in candidates if c.effect == "link_mass" and c.step[1] != 0 and not is_chosen(c, fit.chosen)]
    if not masses:
        return []
    columns = Columns(masses, problem.sensitivities(masses, fit.effects))
    loads: list[Candidate] = []
    for _ in range(problem.thresholds.selection.proposals.all_joints.most_loads):
        gains = score_tests(problem, columns, fit, weights).gain
        best = int(np.argmax(gains))
        if gains[best] < least:
            break
        loads.append(masses[best])
        fit = replace(fit, columns=np.concatenate((fit.columns, columns.values[columns.slices[best]])))
    return loads
