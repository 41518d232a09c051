"""Log-likelihood of a fit less what its parameters cost, to compare fits of different size."""

import re

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, Formula
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.residuals import Problem
from bumblebee.sim.effects import QUOTED, TABLE


def criterion(problem: Problem, fit: Fit) -> float:
    """Log-likelihood of the fitted windows, whose tails are long, less what the parameters cost."""
    left, price = fit.clean(problem), problem.thresholds.comparison.criterion.parameter
    return -0.5 * left.shape[1] * float(np.log1p((left**2).mean(axis=1)).sum()) - price * parameters(fit)


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
        tables = TABLE.findall(text)
        rest = QUOTED.sub("", TABLE.sub("", text))
        count += sum(points.count(",") // 2 for _, points in tables) if tables else 1
        found |= {x for x in re.findall(r"(?<![\w.^])\d+(?:\.\d+)?(?:e-?\d+)?", rest) if float(x) != 1}
    return count + len(found)
