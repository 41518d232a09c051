"""Many parameters wrong at once: what every joint of a real robot has, fitted together.

A robot on which every joint rubs and comes late is found one effect at a time only by a long way round: each
effect alone explains a twentieth, and what stands for the others' share has a strange name. Where the windows are far
from the noise still after some effects, and the last of these explained little, the usual ones of all joints are fitted
together from the declared values on, beside those found; what is not sure is taken out again, and the rest has to pay
on windows that took no part. The search goes on from there. It never begins so: a load at the end of an arm weakens
all drives as far as these can tell.
"""

from collections.abc import Callable, Sequence

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.fit import Fit, cost_of, gauss_newton, standard_covariance
from bumblebee.diagnosis.holdout import Holdout
from bumblebee.diagnosis.problem import Problem, window_weights

# PACE's set (Bjelonic et al. 2025: armature, damping, friction, offset, delay) and the drive's strength.
KINDS = ("coulomb_friction", "viscous_friction", "armature", "motor_strength", "encoder_offset")
WHOLE = ("command_delay",)
_DAMPING = 1e-3
_SURE = 4.0  # standard errors
_TRIFLE = 0.02  # share of a change that matters
_ROUNDS = 3
_MUCH = 0.1  # fall of log(1 + chi-square)


def usual_effects(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Of `candidates` those that every joint of a real robot has."""
    return [c for c in candidates if (c.effect in KINDS and c.where) or (c.effect in WHOLE and not c.where)]


def fit_many(problem: Problem, candidates: Sequence[Candidate], found: Fit, say: Callable[[str], None]) -> Fit | None:
    """A fit of the usual effects, and of the others that were `found`, that are sure together; None where none is.

    The usual ones start from the declared values.
    """
    usual = usual_effects(candidates)
    others = [c for c in found.chosen if c not in usual]
    if not usual:
        return None
    fit = gauss_newton(problem, (), (), window_weights(problem.residual([[]])[0]))
    weights = window_weights(fit.clean(problem))
    chosen = [*usual, *others]
    values = np.concatenate([*(c.nominal for c in usual), *(found.of(c) for c in others)])
    for _ in range(_ROUNDS):
        fit = gauss_newton(problem, chosen, values, weights, iterations=3, coarse=True, damping=_DAMPING)
        values, weights = fit.values, window_weights(fit.clean(problem))
    say(f"{len(chosen)} usual effects together: chi-square {fit.power(problem):.3g}")
    while len(fit.chosen):
        z = certainty(problem, fit, weights)
        least = _least_sure(fit.chosen, z)
        if not least:
            return fit
        keep = [c for k, c in enumerate(fit.chosen) if k not in least]
        values = np.concatenate([np.empty(0), *(fit.of(c) for c in keep)])
        fit = gauss_newton(problem, keep, values, weights, iterations=2, coarse=True, damping=_DAMPING)
        weights = window_weights(fit.clean(problem))
    return None


def _least_sure(chosen: Sequence[Candidate], z: np.ndarray) -> set[int]:
    """Of each place the effect that is least sure, if it is not: the next one there may be, without it."""
    out = set()
    for where in {c.where for c in chosen}:
        there = [k for k, c in enumerate(chosen) if c.where == where]
        worst = min(there, key=lambda k: z[k])
        if z[worst] < _SURE:
            out.add(worst)
    return out


def pays_together(problem: Problem, holdout: Holdout, before: Fit, after: Fit) -> bool:
    """Whether windows that took no part are better with `after` than with `before`, which lacks some of it, by far.

    Not worse after 1 s either. Without such windows those of `problem`, the fitted ones, decide.
    """
    if holdout.problem is None:
        weights = window_weights(after.clean(problem))
        old, new = (cost_of(problem, fit.residual, weights)[0] for fit in (before, after))
        return new < (1.0 - _MUCH) * old
    gain = np.subtract(*holdout.logs([before, after]))
    return bool(gain.mean() > _MUCH + 2.0 * gain.std() / np.sqrt(len(gain))) and not holdout.worse_later(before, after)


def certainty(problem: Problem, fit: Fit, weights: np.ndarray) -> np.ndarray:
    """How many standard errors each effect (C,) is from the declared value, by its surest parameter; 0 for a trifle."""
    errors = np.sqrt(np.diag(standard_covariance(problem, fit, weights)))
    away = np.abs(fit.values - np.concatenate([c.nominal for c in fit.chosen]))
    counts = (fit.scales > 0) & (away >= _TRIFLE * fit.scales)
    z = np.where(counts, away / np.maximum(errors, 1e-300), 0.0)
    return np.array([z[part].max() for part in fit.slices])
