"""Windows far from the noise, measured by what a fit leaves of them instead of by the sensors' noise.

A real machine has more than any catalogue: what is left after the best joint fit can be a hundred times the noise, and
lies in a few directions, mostly late in a window. By the noise these directions decide everything, and an effect that
shows in others has no standard error to speak of. Here the covariance of what is left, over the windows, takes the
noise's place: generalised least squares in two steps (Aitken; feasible GLS of the textbooks). Where what is left is
white, nothing changes but a common factor.
"""

from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.residuals.problem import Problem
from bumblebee.diagnosis.simulation import Recall
from bumblebee.diagnosis.thresholds.residuals import EmpiricalCovariance


def metric_of(left: np.ndarray, rule: EmpiricalCovariance) -> np.ndarray:
    """Lower triangular (M, M) that makes what is left (W, M), whitened by the noise, white again.

    Each window counts as much as the median one at most. The noise itself is added, and correlations are shrunk by
    M / (M + W), for W windows say that much less than their number of M values.
    """
    count, size = left.shape
    metric = np.eye(size)
    for _ in range(rule.rounds):
        power = ((left @ metric.T) ** 2).mean(axis=1)
        weights = 1.0 / (1.0 + power / max(float(np.median(power)), 1e-12))
        covariance = np.einsum("wi,wj,w->ij", left, left, weights, optimize=True) / weights.sum()
        share = size / (size + count)
        covariance = (1.0 - share) * covariance + share * np.diag(np.diag(covariance)) + np.eye(size)
        metric = np.linalg.inv(np.linalg.cholesky(covariance))
    return metric


def by_misfit(problem: Problem, left: np.ndarray) -> Problem:
    """The problem with its windows measured by what a fit leaves of them, `left` (W, M).

    As it is where the windows are too few for a covariance of their values.
    """
    rule = problem.thresholds.residuals.covariance
    if len(left) < rule.fewest * left.shape[1]:
        return problem
    metric = metric_of(left, rule)

    def turned(values: np.ndarray) -> np.ndarray:
        return np.matmul(values, metric.T.astype(values.dtype))

    old = problem.whitener
    whitener = replace(
        old,
        factor=np.matmul(metric, old.factor),
        curvature=turned(old.curvature),
        moved=turned(old.moved),
        slopes=turned(old.slopes),
    )
    return replace(problem, whitener=whitener, nuisance=turned(problem.nuisance), recall=Recall())
