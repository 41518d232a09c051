"""A fit with an effect more or less, refitted; and what a fit is worth for its parameters."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.acceptance import wald
from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.fit import Fit, cost_of, gauss_newton
from bumblebee.diagnosis.formula import Formula
from bumblebee.diagnosis.problem import Problem, window_weights
from bumblebee.diagnosis.slopes import clipped, effects_at

PARAMETER = 4.0  # log-likelihood that a parameter must bring
SURE = 4.0  # z below which an effect beside a new one is needless


def score(problem: Problem, fit: Fit) -> float:
    """Log-likelihood of the fitted windows, whose tails are long, less what the parameters cost."""
    left = fit.clean(problem)
    return -0.5 * left.shape[1] * float(np.log1p((left**2).mean(axis=1)).sum()) - PARAMETER * parameters(fit)


def parameters(fit: Fit) -> int:
    """How many numbers were found in the data."""
    return sum(numbers_of(c) for c in fit.chosen)


def numbers_of(candidate: Candidate) -> int:
    """How many of one effect's."""
    if isinstance(candidate, Formula):
        return numbers(candidate)
    return len(candidate.free) + bool(candidate.shape_scale)


def numbers(form: Formula) -> int:
    """Numbers of a form that were found in the data: coefficients, frequencies and edges, the heights of a table."""
    found: set[str] = set()
    count = 0
    for text in form.texts:
        tables = re.findall(r"curve\(([^()]*)\)", text)
        rest = re.sub(r"curve\([^()]*\)", "", text)
        count += sum(table.count(",") // 2 for table in tables) if tables else 1
        found |= {x for x in re.findall(r"(?<![\w.^])\d+(?:\.\d+)?(?:e-?\d+)?", rest) if float(x) != 1}
    return count + len(found)


def refitted(problem: Problem, chosen: Sequence[Candidate], values: np.ndarray, known: Fit | None = None) -> Fit:
    """All effects at their best from `values` (P,), windows weighed as the first trial leaves them.

    Sensitivities of a fit that is `known` are taken over where nothing near has changed.
    """
    residual = problem.residual([effects_at(chosen, clipped(chosen, values))])[0]
    _, nuisance = cost_of(problem, residual, np.ones(len(residual)))
    weights = window_weights(residual - np.tensordot(nuisance, problem.nuisance, axes=1))
    return gauss_newton(problem, chosen, values, weights, iterations=3, coarse=True, known=known)


def without_needless(problem: Problem, fit: Fit, kept: Candidate) -> Fit:
    """Less the effects that `kept` has made needless, the least sure first; forms stay."""
    while True:
        weights = window_weights(fit.clean(problem))
        spared = [c is kept or (isinstance(c, Formula) and not isinstance(kept, Formula)) for c in fit.chosen]
        z = [np.inf if s else wald(problem, fit, weights, i) for i, s in enumerate(spared)]
        worst = int(np.argmin(z))
        if z[worst] >= SURE:
            return fit
        chosen, values = without_one(fit.chosen, fit.values, fit.chosen[worst])
        fit = gauss_newton(problem, chosen, values, weights, iterations=2, coarse=True, known=fit)


def without_one(
    chosen: Sequence[Candidate], values: np.ndarray, gone: Candidate
) -> tuple[tuple[Candidate, ...], np.ndarray]:
    """The chosen effects and their values less one."""
    keep, at = [], 0
    for c in chosen:
        if c is not gone:
            keep += list(range(at, at + len(c.nominal)))
        at += len(c.nominal)
    return tuple(c for c in chosen if c is not gone), values[keep]


def less(problem: Problem, fit: Fit, gone: Sequence[Candidate]) -> Fit:
    """The fit less some effects, the others where they are."""
    chosen, values = fit.chosen, fit.values
    for c in gone:
        chosen, values = without_one(chosen, values, c)
    ones = np.ones(len(problem.windows))
    bare = gauss_newton(problem, chosen, values, ones, iterations=0, known=fit)
    weights = window_weights(bare.clean(problem))
    return replace(bare, nuisance=cost_of(problem, bare.residual, weights)[1])
