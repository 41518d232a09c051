"""Evolution over the usual set, in the manner of PACE: armature, damping, friction and offset a joint, one delay.

The covariance matrix adaptation evolution strategy with its standard constants (Hansen, "The CMA Evolution Strategy: A
Tutorial", table 1), on parameters in units of a step. The cost is the mean square of the whitened residual.
"""

import numpy as np

from benchmarks.undeclared.rivals.common import Answer, Parameter, error_of, joint_parameters, named, residuals_of
from bumblebee.diagnosis.residuals import Problem
from bumblebee.sim.effects import Effect
from bumblebee.stand_in.undeclared.declared import Declared

_KINDS = ("armature", "viscous_friction", "coulomb_friction", "encoder_offset")
_GENERATIONS = 60


def run(robot: Declared, problem: Problem, rng: np.random.Generator) -> Answer:
    """Evolve, then name."""
    parameters = joint_parameters(robot, _KINDS)
    delay = Parameter("command_delay", robot.joints, "delay", 0.0, 0.003, 0.0, 0.08)
    every = [*parameters, delay]
    steps, start = np.array([abs(p.step) for p in every]), np.array([p.nominal for p in every])

    def effects(x: np.ndarray) -> list[Effect]:
        return [p.at(v) for p, v in zip(every, start + steps * x, strict=True)]

    def costs(rows: np.ndarray) -> np.ndarray:
        outside = np.array([_outside(every, start + steps * x) for x in rows])
        return (residuals_of(problem, [effects(x) for x in rows]) ** 2).mean(axis=1) * (1 + outside)

    best = evolve(costs, np.zeros(len(every)), 1.0, _GENERATIONS, rng)
    values = np.array([np.clip(v, p.low, p.high) for p, v in zip(every, start + steps * best, strict=True)])
    return Answer(named(problem, every, values), error_of(effects(best)))


def _outside(parameters: list[Parameter], values: np.ndarray) -> float:
    """How far beyond the bounds, in steps squared, times a hundredth."""
    return 0.01 * sum(
        (max(p.low - v, v - p.high, 0.0) / abs(p.step)) ** 2 for p, v in zip(parameters, values, strict=True)
    )


def evolve(costs, x0: np.ndarray, sigma: float, generations: int, rng: np.random.Generator) -> np.ndarray:
    """The best point seen of a function of rows, (n,)."""
    n = len(x0)
    size = 4 + int(3 * np.log(n))
    parents = size // 2
    w = np.log((size + 1) / 2) - np.log(np.arange(1, parents + 1))
    w /= w.sum()
    mu = 1 / (w**2).sum()
    cc, cs = (4 + mu / n) / (n + 4 + 2 * mu / n), (mu + 2) / (n + mu + 5)
    c1 = 2 / ((n + 1.3) ** 2 + mu)
    cmu = min(1 - c1, 2 * (mu - 2 + 1 / mu) / ((n + 2) ** 2 + mu))
    damp = 1 + 2 * max(0.0, np.sqrt((mu - 1) / (n + 1)) - 1) + cs
    expected = np.sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n**2))
    mean, cov, path_c, path_s = x0.astype(float), np.eye(n), np.zeros(n), np.zeros(n)
    best, lowest = mean.copy(), np.inf
    for generation in range(generations):
        values, vectors = np.linalg.eigh(cov)
        values = np.sqrt(np.maximum(values, 1e-20))
        y = (rng.standard_normal((size, n)) * values) @ vectors.T
        x = mean + sigma * y
        f = costs(x)
        order = np.argsort(f)
        if f[order[0]] < lowest:
            best, lowest = x[order[0]].copy(), float(f[order[0]])
        step = w @ y[order[:parents]]
        mean = mean + sigma * step
        path_s = (1 - cs) * path_s + np.sqrt(cs * (2 - cs) * mu) * (vectors @ ((vectors.T @ step) / values))
        short = np.linalg.norm(path_s) / np.sqrt(1 - (1 - cs) ** (2 * generation + 2)) < (1.4 + 2 / (n + 1)) * expected
        path_c = (1 - cc) * path_c + short * np.sqrt(cc * (2 - cc) * mu) * step
        rank = (y[order[:parents]].T * w) @ y[order[:parents]]
        cov = (1 - c1 - cmu) * cov + c1 * (np.outer(path_c, path_c) + (1 - short) * cc * (2 - cc) * cov) + cmu * rank
        sigma *= np.exp((cs / damp) * (np.linalg.norm(path_s) / expected - 1))
    return best
