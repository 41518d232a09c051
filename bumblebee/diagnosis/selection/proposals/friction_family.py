"""A joint's friction as a sum of members of one family: dry, viscous, at rest, with the load, by direction, quadratic.

A real gear's friction has several of these at once, each small beside the first. Named one by one, each would have to
stand out among all candidates of the robot; as a further number of a friction that was found it has to be worth its
number by the information criterion, to be sure beside the others, and to be no worse on the windows that judge. So the
nested sums of a joint are gone through upward, the best next member first, all refitted jointly, and downward again
where a member has become worth less than its number. Friction that goes with the load may differ by the direction of
the motion, which is one more number. By whether the drive pulls or holds it may not: there a friction that differs and
a drive of another strength are the same torque while the joint moves.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, is_chosen
from bumblebee.diagnosis.comparison import columns_without, compare, criterion, refitted_without, wald
from bumblebee.diagnosis.selection.changes import Asking, Refitted, Taken
from bumblebee.diagnosis.selection.moves import Move, Terms, refitted
from bumblebee.diagnosis.selection.proposals.rubbing_joints import worth_asking
from bumblebee.diagnosis.selection.score_tests import score_tests
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.selection.trial import try_one

LOAD = "load_dependent_friction"
MEMBERS = (
    "coulomb_friction",
    "viscous_friction",
    "stribeck_friction",
    LOAD,
    "asymmetric_friction",
    "quadratic_friction",
)


def complete_frictions(run: SearchState) -> Asking[bool]:
    """On every joint with a friction the sum of the family that explains it best; whether anything has changed."""
    changed = False
    rubbing = list(dict.fromkeys(c.where for c in run.fit.chosen if c.effect in MEMBERS))
    for where in worth_asking(run, rubbing):
        for _ in MEMBERS:
            move = _next_member(run, where) or _by_direction(run, where)
            if move is None:
                break
            yield Taken(move, rivals=len(MEMBERS))  # no further name but a number of the same friction
            yield from _drop_members(run, where)
            changed = True
    return changed


def _next_member(run: SearchState, where: str) -> Move | None:
    """The member that makes the joint's friction better by most, if any is worth its number."""
    rule = run.problem.thresholds.selection.proposals.friction_family
    no_worse = run.problem.thresholds.comparison.no_worse_on_average
    start = criterion(run.problem, run.fit)
    terms = Terms(rule.sure, (no_worse,), rule.iterations, weighed_after=True)
    best: tuple[float, Move] | None = None
    for candidate, steps in _promising(run, where):
        trial = try_one(run.problem, run.fit, candidate, steps, run.weights)
        if trial is None:
            continue
        move = refitted(run.now, run.fit, candidate, [np.concatenate((run.fit.values, trial.values))], terms)
        gain = -np.inf if move is None else criterion(run.problem, move.after) - start
        if move is not None and gain > (best[0] if best else rule.clearly) and move.passes():
            best = gain, move
    return best[1] if best else None


def _by_direction(run: SearchState, where: str) -> Move | None:
    """A coefficient of the load's friction for each direction in the place of one for both, if worth its number."""
    rule, rules = run.problem.thresholds.selection.proposals.friction_family, run.problem.thresholds.comparison
    both = (c for c in run.fit.chosen[run.given :] if (c.effect, c.where) == (LOAD, where) and len(c.free) == 1)
    for plain in both:
        candidate = replace(plain, step=(plain.step[0], plain.step[0]), free=(0, 1))
        rest = columns_without(run.problem, run.fit, [plain])
        start = np.concatenate((rest.values, run.fit.of(plain)))
        terms = Terms(rule.sure, (rules.no_worse_on_average,), rule.iterations, weighed_after=True)
        move = refitted(run.now, rest, candidate, [start], terms)
        if move is None or criterion(run.problem, move.after) < criterion(run.problem, run.fit) + rule.clearly:
            continue
        if move.passes():
            return move
    return None


def _promising(run: SearchState, where: str) -> Iterator[tuple[Candidate, np.ndarray]]:
    """Members that the joint lacks and the steps that the screening windows suggest, most promising first."""
    rule = run.problem.thresholds.selection.proposals.friction_family
    every = run.columns.candidates
    open_ = [k for k, c in enumerate(every) if c.where == where and c.effect in MEMBERS]
    open_ = [k for k in open_ if not is_chosen(every[k], run.fit.chosen)]
    if not open_:
        return
    tests = score_tests(run.small, run.columns.only(open_), run.small_fit(), run.weights[run.keep])
    least = rule.promising * max(run.fit.power(run.problem), 1.0)
    order = [k for k in np.argsort(-tests.gain)[: rule.tried] if tests.gain[k] > least]
    for k in order:
        yield every[open_[k]], tests.steps[k]


def _drop_members(run: SearchState, where: str) -> Asking[None]:
    """Members that beside the last one are no longer sure, or worth their numbers; the last one stays."""
    rule = run.problem.thresholds.selection.proposals.friction_family
    rules = run.problem.thresholds.comparison
    for c in [c for c in run.fit.chosen[run.given : -1] if c.where == where and c.effect in MEMBERS]:
        sure = wald(run.problem, run.fit, run.weights, run.fit.chosen.index(c)) >= rule.sure
        less = refitted_without(run.problem, run.fit, [c], run.fit)
        if sure and criterion(run.problem, less) < criterion(run.problem, run.fit) - rule.clearly:
            continue
        if compare(run.problem, run.holdout, run.fit, less).passes(rules.no_worse_within_errors):
            yield Refitted(less, f"removed as redundant given its other friction: {c.effect} on {where}")
