"""When an effect is kept: the bound on its z, its Wald test in the joint fit, what else could gain as much, pruning."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.fit import Fit, cost_of, expected_covariance, standard_covariance
from bumblebee.diagnosis.holdout import Holdout
from bumblebee.diagnosis.limits import KINDS as LIMITS
from bumblebee.diagnosis.numerics import beyond_numerics
from bumblebee.diagnosis.problem import Problem
from bumblebee.diagnosis.scores import Columns, as_z, null_maxima
from bumblebee.diagnosis.whiten import null_draws

# Where the model restarts a late encoder's joint follows from the mean of two noisy readings: that alone gains a
# little of the chi-square of the joint's own signals, on all joints at once more.
_NOISY, _NOISY_GAIN, _NOISY_ALL = ("encoder_delay",), 0.1, 0.05

# What these do grows with no power of their size, in few windows.
ABRUPT = ("backlash",)


@dataclass(eq=False)
class Step:
    """One accepted effect: the evidence for it when it was accepted."""

    candidate: Candidate
    z: float
    p: float


def least_z(problem: Problem, columns: Columns, fit: Fit, count: int, level: float) -> float:
    """The z for `level` over `count` candidates: Bonferroni's, or that of simulated null datasets if higher.

    `columns` (of all candidates) and `fit` are on the windows of `problem`.
    """
    draws = null_draws(problem.whitener, problem.sigma, np.random.default_rng(0))
    maxima = null_maxima(problem, columns, fit, np.ones(len(problem.windows)), draws)
    scale = maxima.std() * np.sqrt(6) / np.pi  # a Gumbel distribution of the same mean and variance
    simulated = maxima.mean() - scale * (np.euler_gamma + np.log(-np.log1p(-level)))
    return float(max(norm.isf(level / (2 * count)), simulated))


def is_worse(problem: Problem, fit: Fit, less: Fit, z: float) -> bool:
    """Whether an effect less costs more than one of `z` standard errors is worth, at the residual's power."""
    power = max(fit.power(problem), 1.0)
    return less.cost - fit.cost > 2.0 * z**2 * power


def wald(problem: Problem, fit: Fit, weights: np.ndarray, index: int) -> float:
    """The z of one chosen effect's free parameters in the joint fit."""
    candidate, part = fit.chosen[index], fit.slices[index]
    if candidate.effect in ABRUPT:
        return _lost(problem, fit, weights, index)
    free = part.start + np.array(candidate.free)
    # Windows that feel a limit are too few for a variance between windows.
    of = expected_covariance if candidate.effect in LIMITS else standard_covariance
    covariance = of(problem, fit, weights)[np.ix_(free, free)]
    away = fit.values[free] - np.array(candidate.nominal)[list(candidate.free)]
    value = float(away @ np.linalg.pinv(covariance, rcond=1e-9, hermitian=True) @ away)
    return as_z(value, len(free), len(weights))


def _lost(problem: Problem, fit: Fit, weights: np.ndarray, index: int) -> float:
    """The same for an effect of which slopes say nothing: by what the fit loses without it, the others as they are."""
    others = [e for k, e in enumerate(fit.effects) if k != index]
    rise = cost_of(problem, problem.residual([others])[0], weights)[0] - fit.cost
    return as_z(max(rise, 0.0) / max(fit.power(problem), 1.0), 1, len(weights))


def evidence(candidate: Candidate, z: float, count: int) -> Step:
    """The step that adds a candidate, its p shared among `count` candidates."""
    return Step(candidate, z, min(1.0, 2 * norm.sf(z) * count))


def is_physical(problem: Problem, fit: Fit, new: Fit, candidate: Candidate, weights: np.ndarray) -> bool:
    """Whether neither another integrator nor the readings' noise would do what the new fit gains.

    `fit` is the one without the candidate; `weights` (W,) are the new one's.
    """
    if candidate.effect in _NOISY:
        before = cost_of(problem, fit.residual, weights)[0]
        own = 2 / problem.layout.size  # position and speed
        if before - new.cost < (_NOISY_GAIN * own if candidate.where else _NOISY_ALL) * before:
            return False
    return beyond_numerics(problem, fit, new, weights)


Refit = Callable[[Sequence[Candidate], np.ndarray], Fit]
"""Fits chosen candidates from their values (P,)."""


def pruned(
    problem: Problem,
    fit: Fit,
    weights: np.ndarray,
    bound: float,
    refit: Refit,
    holdout: Holdout | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Fit:
    """The fit less effects that the others have made needless, worst first, refitting each time.

    One whose loss the others cannot make up for stays, however little the slopes at the fit say of it: far from
    the declared value they say nothing of the way back. `bound` is the z that an effect must reach. With `holdout`
    an effect also stays if held-out windows would be worse after 1 s without it.
    """
    kept: set[Candidate] = set()
    while len(kept) < len(fit.chosen):
        z = [np.inf if c in kept else wald(problem, fit, weights, i) for i, c in enumerate(fit.chosen)]
        worst = int(np.argmin(z))
        if z[worst] >= bound:
            break
        keep = [i for i in range(len(fit.chosen)) if i != worst]
        values = [fit.values[fit.slices[i]] for i in keep]
        less = refit([fit.chosen[i] for i in keep], np.concatenate(values) if values else np.empty(0))
        if is_worse(problem, fit, less, bound) or (holdout is not None and holdout.worse_later(fit, less)):
            kept.add(fit.chosen[worst])
            continue
        say(f"needless: {fit.chosen[worst].effect} on {fit.chosen[worst].where}")
        fit = less
    return fit
