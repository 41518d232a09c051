"""Which law a hysteresis follows: a spring that yields at a width, or Dahl's, which turns round smoothly.

Both begin with the same slope and end at the same torque, and where a joint moves to and fro by less than the width
they are nearly alike, with widths two to five times apart. The search meets each at two widths alone, so the law that
it names is that of the better guess. So the other one is tried at a series of widths in its place
(`selection/swap.py`). Where in the end neither is worse beyond doubt, no law is known, and the interval of amplitude
and width is that of both together: what such data tell is the slope.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.comparison import Holdout, columns_without, compare
from bumblebee.diagnosis.estimation import Fit, gauss_newton
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.changes import Vain
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.trial import Trial, try_one
from bumblebee.diagnosis.thresholds.proposals import HysteresisLaw

KIND = "hysteresis"


def law_swaps(run: SearchState, free: Sequence[Candidate]) -> Iterator[tuple[Fit, Trial] | Vain]:
    """A fit without each hysteresis of the `free` ones, and the other law that is tried in its place."""
    for c in [c for c in free if c.effect == KIND]:
        if (KIND, c.where) in run.hopeless or not has_other_law(run.candidates, c):
            continue
        yield Vain(KIND, c.where)
        rest = columns_without(run.problem, run.fit, [c])
        trial = _best_trial(run.problem, rest, c, run.fit.of(c), run.weights)
        if trial is not None:
            yield rest, trial


def has_other_law(candidates: Sequence[Candidate], chosen: Candidate) -> bool:
    """Whether the joint of a hysteresis can have the other law, too: a declared spring leaves Dahl's alone."""
    same = [c for c in candidates if (c.effect, c.where) == (KIND, chosen.where)]
    return any(c.step[2] != chosen.step[2] for c in same)


def other_law(problem: Problem, holdout: Holdout, fit: Fit, chosen: Candidate, weights: np.ndarray) -> Fit | None:
    """The fit with the other law in the place of a hysteresis; None where the windows, fitted or not, speak against it.

    The other law is the last of its chosen.
    """
    rules = problem.thresholds
    rest = columns_without(problem, fit, [chosen])
    trial = _best_trial(problem, rest, chosen, fit.of(chosen), weights)
    if trial is None:
        return None
    values, rule = np.concatenate((rest.values, trial.values)), rules.selection.proposals.hysteresis_law
    other = gauss_newton(problem, (*rest.chosen, trial.candidate), values, weights, rule.iterations, known=fit)
    alike = compare(problem, holdout, fit, other).passes(rules.comparison.not_refuted)
    return other if alike else None


def _best_trial(
    problem: Problem, rest: Fit, chosen: Candidate, values: np.ndarray, weights: np.ndarray
) -> Trial | None:
    """The other law at the width of a series that fits best beside the `rest`; from `values` (3,) of the one law."""
    rule = problem.thresholds.selection.proposals.hysteresis_law
    trials = []
    for ratio in rule.widths:
        candidate = _with_other_law(chosen, values, ratio, rule)
        trials.append(try_one(problem, rest, candidate, np.ones(1), weights))
    return min((t for t in trials if t is not None), key=lambda t: t.cost, default=None)


def _with_other_law(chosen: Candidate, values: np.ndarray, ratio: float, rule: HysteresisLaw) -> Candidate:
    """The other law at `ratio` times the width; its amplitude at a first step keeps the slope, or is no smaller."""
    amplitude, width = values[0] * max(ratio, 1.0), values[1] * ratio
    step = (float(amplitude), float(width), 0.0 if chosen.step[2] else 1.0)
    return replace(chosen, step=step, shape_scale=float(rule.shape * width))
