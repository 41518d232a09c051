"""The effects on a servo's gains in their plainest form: one effect where one does, else kp and kd.

`motor_strength` scales kp and kd together, so any two of the three can say what any other two say. A forward search
takes that which explains most first, and so writes half the damping as kp twice and strength half. A servo damps as the
joint does, so viscous friction together with one of them may be the rest of another: a weaker drive whose damping is
made up for is a lower kp.
"""

from collections.abc import Callable, Sequence

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.estimation import Fit, gauss_newton
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.changes import Asking, Renamed
from bumblebee.diagnosis.selection.state import SearchState

KINDS = ("motor_strength", "kp", "kd")


def plain_gains(
    problem: Problem,
    fit: Fit,
    candidates: Sequence[Candidate],
    weights: np.ndarray,
    bound: float,
    say: Callable[[str], None] = lambda text: None,
) -> Fit:
    """A fit in which no joint has two effects on its gains where one fits as well, and none has other two than kp, kd.

    As well: the cost rises by less than `bound` squared, that of an effect which would be redundant, or by less than a
    thousandth of what these effects lowered it by.
    """
    rule = problem.thresholds.selection.proposals.gain_parameters
    for where in sorted({c.where for c in fit.chosen if c.effect in KINDS}):
        there = {c.effect: c for c in candidates if c.where == where and c.effect in KINDS}
        mine = [c for c in fit.chosen if c.where == where and c.effect in KINDS]
        damper = [c for c in fit.chosen if (c.effect, c.where) == ("viscous_friction", where)] if len(mine) == 1 else []
        if len(mine) + len(damper) < 2 or len(there) < len(KINDS):
            continue
        factor = {c.effect: float(fit.of(c)[0]) for c in mine}
        strength = factor.get("motor_strength", 1.0)
        both = {"kp": strength * factor.get("kp", 1.0), "kd": strength * factor.get("kd", 1.0)}
        alone = sorted(both.values(), key=lambda v: abs(np.log(max(v, 1e-6))))[-1]
        singles = [{"kp": both["kp"]}, {"kd": both["kd"]}, {"motor_strength": alone}]
        rest = [c for c in fit.chosen if c not in (*mine, *damper)]
        tried = [_refit(problem, fit, rest, there, s, weights) for s in singles]
        best = min(tried, key=lambda f: f.cost)
        most = fit.cost + max(bound**2, rule.share * (_refit(problem, fit, rest, there, {}, weights).cost - fit.cost))
        if best.cost > most:
            if damper:
                continue
            best = _refit(problem, fit, rest, there, both, weights)
            if set(factor) == set(both) or best.cost > most:
                continue
        fit = best
        say(f"as good with fewer parameters: {', '.join(c.effect for c in fit.chosen if c.where == where)} on {where}")
    return fit


def _refit(
    problem: Problem,
    fit: Fit,
    rest: Sequence[Candidate],
    there: dict[str, Candidate],
    factors: dict[str, float],
    weights: np.ndarray,
) -> Fit:
    """The `rest` of a fit's effects and, of those `there` on a servo's gains, some with their factors."""
    chosen = [*rest, *(there[kind] for kind in factors)]
    values = np.concatenate([np.empty(0), *(fit.of(c) for c in rest), *([v] for v in factors.values())])
    return gauss_newton(problem, chosen, values, weights, iterations=2, coarse=True, known=fit)


def merge_gain_parameters(run: SearchState) -> Asking[None]:
    """Effects on a servo's gains in their plainest form."""
    if run.given:  # kp and kd apart from the start on
        return
    yield Renamed(plain_gains(run.problem, run.fit, run.candidates, run.weights, run.bound, run.say))
