"""Each name against its rivals, all others given: what came first need not be what fits best in the end.

A forward search names what explains most of all that is lacking. A force that stands for a mass and another force is
named before either, and stays, for beside it neither gains much. So once the search has ended, each effect, and each
two, is taken out and everything is tested in their place; what promises as much is refitted jointly with the others.
It takes the place if the fitted windows are clearly better with it for its parameters and those that judge no worse.
The search then goes on, since what a wrong name had hidden can now be seen.

What a shaft's swing passes for (a lag, an old reading, a rotor) is tried against shafts of many stiffnesses, which no
test at one of them would show (`diagnosis/shafts.py`).

Friction that grows at rest is felt by the few windows that creep through zero speed. Beside the dry friction that
explains the rest, its score varies too much between windows to be significant; the joint fit tells. Where it was found
first it takes the level that it sits on for its own: stiction of 0.40 N m came out as 0.66. As dry friction is then no
further name but a parameter of the same, it needs three standard errors and not the bound of all candidates.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain, combinations

import numpy as np

from bumblebee.diagnosis.acceptance import evidence, is_physical, wald
from bumblebee.diagnosis.candidates import SHAPED, Candidate
from bumblebee.diagnosis.eligible import is_chosen
from bumblebee.diagnosis.fit import Fit, cost_of, gauss_newton, project, solve
from bumblebee.diagnosis.holdout import Holdout
from bumblebee.diagnosis.limits import KINDS as LIMITS
from bumblebee.diagnosis.problem import Problem, window_weights
from bumblebee.diagnosis.refits import PARAMETER, score
from bumblebee.diagnosis.run import Run
from bumblebee.diagnosis.scores import Columns, Scores, as_z, score_tests
from bumblebee.diagnosis.shafts import KIND as SHAFT
from bumblebee.diagnosis.shafts import LIKE as SHAFT_LIKE
from bumblebee.diagnosis.shafts import best_shaft, is_of_series
from bumblebee.diagnosis.trials import Trial, try_one

_AS_MUCH = 0.95  # share of what the names gain that a rival must promise
_PART = 0.6  # the same of a shaft, whose loss has not been fitted yet
_RIVALS = 2  # tried in the place of the same names
_FEW = 4  # effects up to which two are taken out together
_CLEARLY = 2 * PARAMETER  # log-likelihood by which a rival with as many parameters must be better
_LEVEL = 3.0  # standard errors of the dry friction on which other friction sits
_REST = 0.6  # share of such friction that is left when its level is taken from it
_CREEP = (0.06, 0.2)  # of the joint's usual speed: velocities at which friction is tried to grow


def exchange(run: Run) -> bool:
    """Put one better name in the place of one or two of the search's; whether there was one."""
    free = [c for c in run.fit.chosen[run.given :] if c.effect not in LIMITS]
    taken = [(c,) for c in free] + (list(combinations(free, 2)) if len(free) <= _FEW else [])
    best: tuple[float, Fit, float] | None = None
    start = score(run.problem, run.fit)
    for gone, new, z in chain(*(_tried(run, gone) for gone in taken), _twisted(run, free)):
        gain = score(run.problem, new) - start
        margin = _CLEARLY if len(gone) == 1 else 0.0
        if gain > max(margin, best[0] if best else margin) and _is_no_worse(run.holdout, run.fit, new):
            best = gain, new, z
    if best is None:
        return False
    _, new, z = best
    rival = new.chosen[-1]
    run.steps.append(evidence(rival, z, len(run.candidates)))
    gone = ", ".join(f"{c.effect} on {c.where}" for c in run.fit.chosen if c not in new.chosen)
    run.say(f"{rival.effect} on {rival.where or 'the whole robot'} in the place of {gone}")
    run.renew(new)
    run.closed.clear()
    return True


def creeping(run: Run) -> bool:
    """Try friction that grows at rest beside each dry friction that was found; whether one was accepted."""
    dry = [c for c in run.fit.chosen if c.effect == "coulomb_friction"]
    found = False
    for c in dry:
        kinds = [o for o in run.candidates if (o.effect, o.where) == ("stribeck_friction", c.where)]
        if not kinds or is_chosen(kinds[0], run.fit.chosen):
            continue
        looked = [_slower(max(kinds, key=lambda o: o.step[1]), share) for share in _CREEP]
        tests = score_tests(run.problem, run.sensitivities(looked), run.fit, run.weights)
        k = int(np.argmax(tests.gain))
        power = max(run.fit.power(run.problem), 1.0)
        if tests.gain[k] < power * run.bound**2 or looked[k] in run.closed:
            continue
        values = looked[k].start
        values[0] = tests.steps[k][0] * looked[k].step[0]
        found |= bool(values[0] > 0) and run.accept(looked[k], values)
    return found


def levelled(run: Run) -> None:
    """Fit dry friction beside friction of its joint that depends on direction or speed, where that was found alone."""
    for c in [c for c in run.fit.chosen if c.effect in SHAPED]:
        dry = next((o for o in run.candidates if (o.effect, o.where) == ("coulomb_friction", c.where)), None)
        if dry is None or is_chosen(dry, run.fit.chosen):
            continue
        chosen = (*run.fit.chosen, dry)
        tried = [
            gauss_newton(run.problem, chosen, start, run.weights, iterations=5, coarse=True, known=run.fit)
            for start in _on_level(run.fit, c, dry)
        ]
        fit = min(tried, key=lambda one: one.cost)
        z = wald(run.problem, fit, run.weights, len(chosen) - 1)
        if z < _LEVEL or fit.of(dry)[0] < dry.nominal[0] or not _is_no_worse(run.holdout, run.fit, fit):
            continue
        run.say(f"{c.effect} on {c.where} sits on dry friction: {fit.of(dry).round(5)}")
        run.steps.append(evidence(dry, z, 1))
        run.renew(fit)


def _on_level(fit: Fit, candidate: Candidate, dry: Candidate) -> list[np.ndarray]:
    """Values (P,) from which the two are fitted: the first less a share that is level, or at the velocity of a trial.

    With a velocity far too high it is all level already, and no slope leads from there.
    """
    mine = fit.slices[fit.chosen.index(candidate)]
    shaping = [mine.start + i for i in range(mine.stop - mine.start) if i not in candidate.free]
    near, far = fit.values.copy(), fit.values.copy()
    near[mine] *= _REST
    far[shaping] = candidate.start[[i - mine.start for i in shaping]]
    level = dry.nominal[0] + (1 - _REST) * abs(fit.values[mine.start])
    return [np.append(near, level), np.append(far, dry.start)]


def _slower(candidate: Candidate, share: float) -> Candidate:
    """The same friction at a share of its velocity."""
    speed = share * candidate.step[1]
    return replace(candidate, step=(candidate.step[0], speed), shape_scale=0.3 * speed)


_Tried = tuple[Sequence[Candidate], Fit, float]
"""Names that are gone, the fit without them and with their rival last, and the rival's z."""


def _tried(run: Run, gone: Sequence[Candidate]) -> Iterator[_Tried]:
    """Fits with one rival in the place of some names, those that promise most."""
    weights, all_of = run.weights[run.keep], run.small_fit()
    small = _without(run.small, all_of, gone)
    own = _least(run.small, small, weights) - _least(run.small, all_of, weights)
    tests = score_tests(run.small, run.columns, small, weights)
    promising = _promising(run.columns, tests, small, gone, _AS_MUCH * own)
    if not promising:
        return
    rest = _without(run.problem, run.fit, gone)
    for k in promising:
        rival = run.columns.candidates[k]
        trial = try_one(run.problem, rest, rival, tests.steps[k], run.weights)
        new = _refitted(run, rest, trial) if trial else None
        if new:
            yield gone, *new


def _twisted(run: Run, free: Sequence[Candidate]) -> Iterator[_Tried]:
    """Fits with a shaft in the place of what its swing passes for, on each joint that has such a name."""
    for where in dict.fromkeys(c.where for c in free if c.where and c.effect in SHAFT_LIKE):
        if (SHAFT, where) in run.hopeless:
            continue
        gone = [c for c in free if c.where == where and c.effect in SHAFT_LIKE]
        if len(gone) == 1 and is_of_series(gone[0], run.fit.of(gone[0])):
            continue
        rest = _without(run.problem, run.fit, gone)
        own = _least(run.problem, rest, run.weights) - _least(run.problem, run.fit, run.weights)
        run.hopeless.add((SHAFT, where))
        trial = best_shaft(run.problem, rest, run.candidates, run.weights, where, _PART * own)
        new = _refitted(run, rest, trial) if trial else None
        if new:
            yield gone, *new


def _refitted(run: Run, rest: Fit, trial: Trial) -> tuple[Fit, float] | None:
    """The joint fit with a rival and the rival's z, if it is sure of it."""
    rival = trial.candidate
    chosen, start = (*rest.chosen, rival), np.concatenate((rest.values, trial.values))
    new = gauss_newton(run.problem, chosen, start, run.weights, iterations=3, coarse=True, known=run.fit)
    weights = window_weights(new.clean(run.problem))
    z = _certainty(run, rest, new, weights)
    if z < run.bound or not is_physical(run.problem, rest, new, rival, weights):
        return None
    return new, z


def _certainty(run: Run, rest: Fit, new: Fit, weights: np.ndarray) -> float:
    """The z of a rival; of a shaft, half of which swings out of step, by what the fit loses without it if more."""
    z = wald(run.problem, new, weights, len(new.chosen) - 1)
    if new.chosen[-1].effect != SHAFT:
        return z
    fall = cost_of(run.problem, rest.residual, weights)[0] - new.cost
    numbers = int(np.count_nonzero(new.chosen[-1].scales))
    return max(z, as_z(max(fall, 0.0) / max(new.power(run.problem), 1.0), numbers, len(weights)))


def _promising(columns: Columns, tests: Scores, rest: Fit, gone: Sequence[Candidate], least: float) -> list[int]:
    """Numbers of the best rivals of other names than those that are gone, one of each name."""
    found: list[int] = []
    names = {(c.effect, c.where) for c in gone}
    for k in np.argsort(-tests.gain):
        c = columns.candidates[k]
        if len(found) >= _RIVALS or tests.gain[k] < least:
            break
        if (c.effect, c.where) in names or c.effect in LIMITS or is_chosen(c, rest.chosen):
            continue
        if c.effect == SHAFT and any(g.where == c.where and g.effect in SHAFT_LIKE for g in gone):
            continue  # of many stiffnesses, see `_twisted`
        names.add((c.effect, c.where))
        found.append(int(k))
    return found


def _without(problem: Problem, fit: Fit, gone: Sequence[Candidate]) -> Fit:
    """The fit less some effects, the others where they are, with the columns that they had."""
    keep = [i for i, c in enumerate(fit.chosen) if c not in gone]
    owner = [i for i, c in enumerate(fit.chosen) for _ in range(int(np.count_nonzero(c.scales)))]
    effects = [fit.effects[i] for i in keep]
    values = np.concatenate([np.empty(0), *(fit.values[fit.slices[i]] for i in keep)])
    return replace(
        fit,
        chosen=tuple(fit.chosen[i] for i in keep),
        values=values,
        residual=problem.residual([effects])[0],
        columns=fit.columns[[i in keep for i in owner]],
    )


def _least(problem: Problem, fit: Fit, weights: np.ndarray) -> float:
    """Cost of a fit, its effects and the nuisances free to move linearly."""
    basis, inverse = project(problem, fit.columns, weights)
    left = fit.residual - np.tensordot(solve(basis, inverse, fit.residual, weights), basis, axes=1)
    return float((weights[:, None] * left**2).sum())


def _is_no_worse(holdout: Holdout, before: Fit, after: Fit) -> bool:
    """Whether the judging windows are no further off, in the mean of log(1 + chi-square), and not later either."""
    if holdout.problem is None:
        return True
    old, new = holdout.logs([before, after])
    return bool(new.mean() <= old.mean()) and not holdout.worse_later(before, after)
