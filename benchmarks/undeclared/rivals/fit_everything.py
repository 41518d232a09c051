"""All parameters at once by damped least squares: what a calibration without selection does."""

import numpy as np

from benchmarks.undeclared.rivals.common import (
    Answer,
    clip,
    effects_at,
    error_of,
    every_parameter,
    jacobian,
    named,
    residuals_of,
)
from bumblebee.diagnosis.residuals import Problem
from bumblebee.stand_in.undeclared.declared import Declared

_ROUNDS = 3


def run(robot: Declared, problem: Problem, rng: np.random.Generator) -> Answer:
    """Levenberg and Marquardt's steps on the whitened residual."""
    parameters = every_parameter(robot)
    steps = np.array([p.step for p in parameters])
    values = np.array([p.nominal for p in parameters])
    damping = 1e-3
    for _ in range(_ROUNDS):
        residual, columns = jacobian(problem, parameters, values)
        normal = columns @ columns.T
        trials = []
        for factor in (0.1, 1.0, 10.0, 100.0):
            scaled = normal + damping * factor * np.diag(np.diag(normal) + 1e-9)
            trials.append(clip(parameters, values - steps * np.linalg.solve(scaled, columns @ residual)))
        costs = (residuals_of(problem, [effects_at(parameters, t) for t in trials]) ** 2).sum(axis=1)
        best = int(np.argmin(costs))
        if costs[best] >= 0.999 * (residual**2).sum():
            break
        values, damping = trials[best], damping * (0.1, 1.0, 10.0, 100.0)[best]
    effects = effects_at(parameters, values)
    return Answer(named(problem, parameters, values), error_of(effects))
