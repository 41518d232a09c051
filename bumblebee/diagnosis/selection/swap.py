"""Each name against its rivals, all others given: what came first need not be what fits best in the end.

A forward search names what explains most of all that is lacking. A force that stands for a mass and another force is
named before either, and stays, for beside it neither gains much. So once the search has ended, each effect, and each
two, is taken out and everything is tested in their place; what promises as much is refitted jointly with the others.
It takes the place if the fitted windows are clearly better with it for its parameters and those that judge no worse.
The search then goes on, since what a wrong name had hidden can now be seen.

Hysteresis by one law is tried against the other (`proposals/hysteresis_law.py`), a torque limit against a drive that
came out far weaker than declared (`proposals/drive_grid.py`).

What a shaft's swing passes for (a lag, an old reading, a rotor) is tried against shafts of many stiffnesses, which no
test at one of them would show (`proposals/joint_elasticity.py`).

Friction that grows at rest is felt by the few windows that creep through zero speed. Beside the dry friction that
explains the rest, its score varies too much between windows to be significant; the joint fit tells. Where it was found
first it takes the level that it sits on for its own: stiction of 0.40 N m came out as 0.66. As dry friction is then no
further name but a parameter of the same, it needs three standard errors and not the bound of all candidates.
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, combinations

import numpy as np

from bumblebee.diagnosis.candidates import SATURATIONS, Candidate, is_chosen
from bumblebee.diagnosis.comparison import (
    columns_without,
    criterion,
    linear_cost,
)
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.selection.changes import Asking, Taken, Vain
from bumblebee.diagnosis.selection.moves import Move, Terms, by_loss, by_slopes, refitted
from bumblebee.diagnosis.selection.proposals.drive_grid import limit_swaps
from bumblebee.diagnosis.selection.proposals.hysteresis_law import law_swaps
from bumblebee.diagnosis.selection.proposals.joint_elasticity import KIND as SHAFT
from bumblebee.diagnosis.selection.proposals.joint_elasticity import LIKE as SHAFT_LIKE
from bumblebee.diagnosis.selection.proposals.joint_elasticity import best_elasticity, is_of_series
from bumblebee.diagnosis.selection.proposals.setpoints import setpoint_swaps
from bumblebee.diagnosis.selection.score_tests import Scores, score_tests
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.trial import Trial, try_one
from bumblebee.diagnosis.sensitivities import Columns


def swap(run: SearchState) -> Asking[bool]:
    """Put one better name in the place of one or two of the search's; whether there was one."""
    rule, free = run.problem.thresholds.selection.swap, _free(run)
    taken = [(c,) for c in free] + (list(combinations(free, 2)) if len(free) <= rule.few else [])
    moves = chain(*(_tried(run, gone) for gone in taken), _twisted(run, free), _shaped(run, free))
    return (yield from _best_taken(run, moves))


def swap_limits(run: SearchState) -> Asking[bool]:
    """Put a torque limit in the place of a drive that came out far weaker than declared; whether one was better."""
    return (yield from _best_taken(run, _limited(run, _free(run))))


def _free(run: SearchState) -> list[Candidate]:
    """Names that may go."""
    return [c for c in run.fit.chosen[run.given :] if c.effect not in SATURATIONS]


def _best_taken(run: SearchState, moves: Iterable[Move | Vain]) -> Asking[bool]:
    """Make the move that gains most, if any is clearly better than none."""
    rule, parameter = run.problem.thresholds.selection.swap, run.problem.thresholds.comparison.criterion.parameter
    best: tuple[float, Move] | None = None
    start = criterion(run.problem, run.fit)
    for move in moves:
        if isinstance(move, Vain):
            yield move
            continue
        gain = criterion(run.problem, move.after) - start
        margin = rule.clearly * parameter if len(move.gone) == 1 else 0.0
        if gain > max(margin, best[0] if best else margin) and move.passes():
            best = gain, move
    if best is None:
        return False
    yield Taken(best[1], reopens=True)
    return True


def _tried(run: SearchState, gone: Sequence[Candidate]) -> Iterator[Move]:
    """Fits with one rival in the place of some names, those that promise most."""
    rule = run.problem.thresholds.selection.swap
    weights, all_of = run.weights[run.keep], run.small_fit()
    small = columns_without(run.small, all_of, gone)
    own = linear_cost(run.small, small, weights) - linear_cost(run.small, all_of, weights)
    tests = score_tests(run.small, run.columns, small, weights)
    promising = _promising(run.columns, tests, small, gone, rule.as_much * own, rule.rivals)
    if not promising:
        return
    rest = columns_without(run.problem, run.fit, gone)
    for k in promising:
        rival = run.columns.candidates[k]
        trial = try_one(run.problem, rest, rival, tests.steps[k], run.weights)
        move = _refitted(run, rest, trial) if trial else None
        if move:
            yield move


def _twisted(run: SearchState, free: Sequence[Candidate]) -> Iterator[Move | Vain]:
    """Fits with a shaft in the place of what its swing passes for, on each joint that has such a name."""
    for where in dict.fromkeys(c.where for c in free if c.where and c.effect in SHAFT_LIKE):
        if (SHAFT, where) in run.hopeless:
            continue
        gone = [c for c in free if c.where == where and c.effect in SHAFT_LIKE]
        if len(gone) == 1 and is_of_series(run.problem, gone[0], run.fit.of(gone[0])):
            continue
        rest = columns_without(run.problem, run.fit, gone)
        own = linear_cost(run.problem, rest, run.weights) - linear_cost(run.problem, run.fit, run.weights)
        yield Vain(SHAFT, where)
        least = run.problem.thresholds.selection.swap.part * own
        trial = best_elasticity(run.problem, rest, run.candidates, run.weights, where, least)
        move = _refitted(run, rest, trial) if trial else None
        if move:
            yield move


def _shaped(run: SearchState, free: Sequence[Candidate]) -> Iterator[Move | Vain]:
    """Fits with a drive's own set-points or limit in the place of what they pass for, or a hysteresis' other law."""
    for found in chain(setpoint_swaps(run, free), law_swaps(run, free)):
        move = found if isinstance(found, Vain) else _refitted(run, *found)
        if move:
            yield move
    yield from _limited(run, free)


def _limited(run: SearchState, free: Sequence[Candidate]) -> Iterator[Move]:
    """Fits with a torque limit in the place of a weak drive."""
    moves = (_refitted(run, rest, trial) for rest, trial in limit_swaps(run, free))
    return (move for move in moves if move)


def _refitted(run: SearchState, rest: Fit, trial: Trial) -> Move | None:
    """The joint fit with a rival, if it is sure of it; half of what is behind a shaft swings out of step."""
    rules, certainty = run.problem.thresholds.comparison, by_loss if trial.candidate.effect == SHAFT else by_slopes
    terms = Terms(run.bound, (rules.no_worse_on_average,), 3, run.weights, weighed_after=True, certainty=certainty)
    return refitted(run.now, rest, trial.candidate, [np.concatenate((rest.values, trial.values))], terms)


def _promising(
    columns: Columns, tests: Scores, rest: Fit, gone: Sequence[Candidate], least: float, most: int
) -> list[int]:
    """Numbers of the best rivals of other names than those that are gone, one of each name."""
    found: list[int] = []
    names = {(c.effect, c.where) for c in gone}
    for k in np.argsort(-tests.gain):
        c = columns.candidates[k]
        if len(found) >= most or tests.gain[k] < least:
            break
        if (c.effect, c.where) in names or c.effect in SATURATIONS or is_chosen(c, rest.chosen):
            continue
        if c.effect == SHAFT and any(g.where == c.where and g.effect in SHAFT_LIKE for g in gone):
            continue  # of many stiffnesses, see `_twisted`
        names.add((c.effect, c.where))
        found.append(int(k))
    return found
