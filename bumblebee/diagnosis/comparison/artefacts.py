"""Gains that are no effect's: what another integrator, or the restart from noisy readings, would do by itself."""

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.estimation import Fit, beyond_numerics, cost_of
from bumblebee.diagnosis.residuals import Problem

_RESTARTED_BY = ("encoder_delay",)


def is_physical(problem: Problem, fit: Fit, new: Fit, candidate: Candidate, weights: np.ndarray) -> bool:
    """Whether neither another integrator nor the readings' noise would do what the new fit gains.

    `fit` is the one without the candidate; `weights` (W,) are the new one's.
    """
    if candidate.effect in _RESTARTED_BY:
        rule = problem.thresholds.comparison.artefact
        before = cost_of(problem, fit.residual, weights)[0]
        own = 2 / problem.layout.size  # position and speed
        if before - new.cost < (rule.joint_gain * own if candidate.where else rule.robot_gain) * before:
            return False
    return beyond_numerics(problem, fit, new, weights)
