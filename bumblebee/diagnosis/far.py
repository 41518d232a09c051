"""Servos far from the declared ones, found before anything else is looked for: gains, and dry friction beside them.

Where a model's gains are off by factors, residuals are so far from linear that no slope and no test says anything, and
every effect helps. Published gains are often another firmware's, and the joints of a robot often share one type of
servo: so factors on kp and kd of all servos at once are tried first, over orders of magnitude, then every servo's own
gains and dry friction beside the others'. Friction is there because a joint that sticks looks like one of large damping
as long as it may not stick. The score is the mean of log(1 + power) over windows: as linear as chi-square where a model
is nearly right, and the log of the error where it is far off, so that a few windows do not decide alone.
"""

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.problem import Problem
from bumblebee.sim.effects import Effect, single

KINDS = ("kp", "kd", "coulomb_friction")
_SHARED = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 2.0, 5.0)
_WINDOWS = 48
_SWEEPS = ((0.4, 2.5), (0.4, 2.5), (0.4, 2.5), (0.65, 1.5), (0.8, 1.25))  # factors that each number is moved by
_RUBS = (0.1, 0.4, 1.0)  # dry friction tried first, in steps of its candidate
_BETTER = 0.1  # fall of the score
_LEAST = 1e-3  # smallest factor tried
_STEP = 0.1  # share of a value that matters

Servo = tuple[float, float, float]
"""Factors on kp and kd, dry friction [N m]."""


def far_servos(problem: Problem, candidates: Sequence[Candidate]) -> list[tuple[Candidate, float]]:
    """Candidates of `KINDS` with values, all servos together; empty where none makes the model much better.

    Their steps are a tenth of the values: at a hundredth of the declared gain a tenth of it is no small change.
    """
    table = {(c.effect, c.where): c for c in candidates if c.effect in KINDS}
    names = [where for effect, where in table if effect == "kp" and ("kd", where) in table]
    if not names:
        return []
    declared = {where: (1.0, 1.0, table["coulomb_friction", where].nominal[0]) for where in names}
    part = problem.part(np.unique(np.linspace(0, len(problem.windows) - 1, _WINDOWS).round().astype(int)))
    servos = _shared(part, declared)
    for factors in _SWEEPS:
        servos = _swept(part, servos, factors, {w: abs(table["coulomb_friction", w].step[0]) for w in names})
    before, after = _scores(part, [declared, servos])
    if before - after < _BETTER:
        return []
    found = []
    for where, values in servos.items():
        for effect, value, old in zip(KINDS, values, declared[where], strict=True):
            if value != old:
                found.append((replace(table[effect, where], step=(np.sign(value - old) * _STEP * value,)), value))
    return found


def _shared(problem: Problem, declared: dict[str, Servo]) -> dict[str, Servo]:
    """The best of all factors on every servo's gains at once."""
    options = [{w: (p, d, s[2]) for w, s in declared.items()} for p, d in itertools.product(_SHARED, _SHARED)]
    return options[int(np.argmin(_scores(problem, options)))]


def _swept(
    problem: Problem, servos: dict[str, Servo], factors: Sequence[float], rub: dict[str, float]
) -> dict[str, Servo]:
    """Each servo moved to the best of some options beside the others as they were."""
    options = [(w, o) for w in servos for o in _options(servos[w], factors, rub[w])]
    scores = _scores(problem, [servos, *({**servos, w: o} for w, o in options)])
    own: dict[str, Servo] = {}
    for where in servos:
        better = [(s, o) for s, (at, o) in zip(scores[1:], options, strict=True) if at == where and s < scores[0]]
        if better:
            own[where] = min(better)[1]
    if not own:
        return servos
    together, best = {**servos, **own}, int(np.argmin(scores))
    where, option = options[best - 1]
    return together if _scores(problem, [together])[0] <= scores[best] else {**servos, where: option}


def _options(servo: Servo, factors: Sequence[float], rub: float) -> list[Servo]:
    kp, kd, dry = servo
    out = [(max(kp * f, _LEAST), kd, dry) for f in factors]
    out += [(kp, max(kd * f, _LEAST), dry) for f in factors]
    out += [(max(kp * f, _LEAST), max(kd * f, _LEAST), dry) for f in factors]
    out += [(kp, max(kd * f, _LEAST), dry + rub * r) for f in (1.0, factors[0]) for r in _RUBS]
    return out + [(kp, kd, dry * f) for f in factors if dry > 0]


def _scores(problem: Problem, several: Sequence[dict[str, Servo]]) -> np.ndarray:
    """Mean of log(1 + whitened power) over the windows for each set of servos, in coarse steps."""
    residual = problem.residual([_effects(servos) for servos in several], coarse=True)
    return np.log1p((residual**2).mean(axis=2)).mean(axis=1)


def _effects(servos: dict[str, Servo]) -> list[Effect]:
    return [single(kind, w, value) for w, values in servos.items() for kind, value in zip(KINDS, values, strict=True)]
