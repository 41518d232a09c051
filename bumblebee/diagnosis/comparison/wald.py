"""How many standard errors an effect is from its declared value, in the joint fit."""

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm
from scipy.stats import f as fisher

from bumblebee.diagnosis.candidates import ABRUPT, SATURATIONS, Candidate
from bumblebee.diagnosis.estimation import Fit, cost_of, expected_covariance, standard_covariance
from bumblebee.diagnosis.residuals import Problem


@dataclass(eq=False)
class Step:
    """One accepted effect: the evidence for it when it was accepted."""

    candidate: Candidate
    z: float
    p: float


def costs_more_than(problem: Problem, fit: Fit, less: Fit, z: float) -> bool:
    """Whether an effect less costs more than one of `z` standard errors is worth, at the residual's power."""
    power = max(fit.power(problem), 1.0)
    return less.cost - fit.cost > 2.0 * z**2 * power


def wald(problem: Problem, fit: Fit, weights: np.ndarray, index: int) -> float:
    """The z of one chosen effect's free parameters in the joint fit."""
    return float(walds(problem, fit, weights, [fit.chosen[index]])[index])


def walds(problem: Problem, fit: Fit, weights: np.ndarray, asked: Collection[Candidate]) -> np.ndarray:
    """The z (F,) of the effects that are `asked`, infinite of others; a covariance serves all effects."""
    of: dict[Callable[..., np.ndarray], np.ndarray] = {}
    out = np.full(len(fit.chosen), np.inf)
    for k, (candidate, part) in enumerate(zip(fit.chosen, fit.slices, strict=True)):
        if candidate not in asked:
            continue
        if candidate.effect in ABRUPT:
            out[k] = _lost(problem, fit, weights, k)
            continue
        # Windows that feel a limit are too few for a variance between windows.
        kind = expected_covariance if candidate.effect in SATURATIONS else standard_covariance
        if kind not in of:
            of[kind] = kind(problem, fit, weights)
        free = part.start + np.array(candidate.free)
        away = fit.values[free] - np.array(candidate.nominal)[list(candidate.free)]
        value = float(away @ np.linalg.pinv(of[kind][np.ix_(free, free)], rcond=1e-9, hermitian=True) @ away)
        out[k] = z_value(value, len(free), len(weights))
    return out


def _lost(problem: Problem, fit: Fit, weights: np.ndarray, index: int) -> float:
    """Wald statistic of an effect whose slopes say nothing: the fit's loss without it, the others as they are."""
    others = [e for k, e in enumerate(fit.effects) if k != index]
    rise = cost_of(problem, problem.residual([others])[0], weights)[0] - fit.cost
    return z_value(max(rise, 0.0) / max(fit.power(problem), 1.0), 1, len(weights))


def evidence(candidate: Candidate, z: float, count: int) -> Step:
    """The step that adds a candidate, its p shared among `count` candidates."""
    return Step(candidate, z, min(1.0, 2 * norm.sf(z) * count))


def z_value(wald: float, count: int, windows: int) -> float:
    """A Wald statistic of `count` parameters over `windows` clusters as a two-sided standard normal."""
    return float(z_values(np.array([wald]), count, windows)[0])


def z_values(wald: np.ndarray, count: int, windows: int) -> np.ndarray:
    """Standard normal values of several statistics (C,)."""
    if count == 1:
        return np.sqrt(wald)
    share = windows - count
    log_p = np.zeros(len(wald))
    if share > 0:
        log_p = fisher.logsf(wald * share / (count * max(windows - 1, 1)), count, share)
    far = ~np.isfinite(log_p) | (log_p < -600)
    log_p[far] = chi2.logsf(np.minimum(wald[far], 1200.0), count)
    return norm.isf(np.exp(np.maximum(log_p, -600.0)) / 2)
