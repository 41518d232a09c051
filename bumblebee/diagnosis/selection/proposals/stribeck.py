"""Stribeck friction, which grows at rest: together with dry friction, or for a part of it."""

from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.candidates import SHAPED, Candidate, is_chosen
from bumblebee.diagnosis.estimation import Fit
from bumblebee.diagnosis.selection.changes import Asking, Offered, Taken
from bumblebee.diagnosis.selection.moves import Terms, refitted
from bumblebee.diagnosis.selection.proposals.rubbing_joints import worth_asking
from bumblebee.diagnosis.selection.score_tests import score_tests
from bumblebee.diagnosis.selection.state import SearchState


def add_stribeck_friction(run: SearchState) -> Asking[bool]:
    """Try Stribeck friction conditional on each dry friction that was found; whether one was accepted."""
    rule = run.problem.thresholds.selection.proposals.stribeck
    dry = [c for c in run.fit.chosen if c.effect == "coulomb_friction"]
    asked, found = worth_asking(run, [c.where for c in dry]), False
    for c in (c for c in dry if c.where in asked):
        kinds = [o for o in run.candidates if (o.effect, o.where) == ("stribeck_friction", c.where)]
        if not kinds or is_chosen(kinds[0], run.fit.chosen):
            continue
        tried = [_slower(max(kinds, key=lambda o: o.step[1]), share, rule.shape_scale) for share in rule.creep]
        tests = score_tests(run.problem, run.sensitivities(tried), run.fit, run.weights)
        k = int(np.argmax(tests.gain))
        power = max(run.fit.power(run.problem), 1.0)
        if tests.gain[k] < power * run.bound**2 or tried[k] in run.closed:
            continue
        values = tried[k].start
        values[0] = tests.steps[k][0] * tried[k].step[0]
        if values[0] > 0:
            accepted = yield Offered(tried[k], values)
            found |= accepted
    return found


def add_dry_friction(run: SearchState) -> Asking[None]:
    """Fit dry friction together with its joint's friction by direction or speed, where that was found alone."""
    rule = run.problem.thresholds.selection.proposals.stribeck
    for c in [c for c in run.fit.chosen if c.effect in SHAPED]:
        dry = next((o for o in run.candidates if (o.effect, o.where) == ("coulomb_friction", c.where)), None)
        if dry is None or is_chosen(dry, run.fit.chosen):
            continue
        no_worse = run.problem.thresholds.comparison.no_worse_on_average
        terms = Terms(rule.dry_z, (no_worse,), rule.iterations, run.weights, artefact=False)
        move = refitted(run.now, run.fit, dry, _on_level(run.fit, c, dry, rule.rest), terms)
        if move is not None and move.after.of(dry)[0] >= dry.nominal[0] and move.passes():
            yield Taken(move, rivals=1)  # no further name but a parameter of the same


def _on_level(fit: Fit, candidate: Candidate, dry: Candidate, rest: float) -> list[np.ndarray]:
    """Values (P,) from which the two are fitted: the first less its level, or at the velocity of a trial.

    The share `rest` of the first is left where its level is taken from it. With a velocity far too high it is all
    level already, and no slope leads from there.
    """
    mine = fit.slices[fit.chosen.index(candidate)]
    shaping = [mine.start + i for i in range(mine.stop - mine.start) if i not in candidate.free]
    near, slow = fit.values.copy(), fit.values.copy()
    near[mine] *= rest
    slow[shaping] = candidate.start[[i - mine.start for i in shaping]]
    level = dry.nominal[0] + (1 - rest) * abs(fit.values[mine.start])
    return [np.append(near, level), np.append(slow, dry.start)]


def _slower(candidate: Candidate, share: float, scale: float) -> Candidate:
    """Law of the friction at a share of its velocity; of that the share `scale` matters."""
    speed = share * candidate.step[1]
    return replace(candidate, step=(candidate.step[0], speed), shape_scale=scale * speed)
