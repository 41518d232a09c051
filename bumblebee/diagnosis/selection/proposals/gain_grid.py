"""Servos with gains far from the declared ones and dry friction, found before anything else is looked for.

Where a model's gains are off by factors, residuals are so far from linear that no slope and no test says anything, and
every effect helps. Published gains are often another firmware's, and the joints of a robot often share one type of
servo: so factors on kp and kd of all servos at once are tried first, over orders of magnitude, then every servo's own
gains and dry friction. Friction is there because a joint that sticks looks like one of large damping as long as it may
not stick.

Windows of a second are compared, for in a short one gain, damping and friction can stand for each other. The score of a
joint is the mean of log(error^2 + (3 noise)^2), so that no few windows decide alone; a servo pays a little for gains
unlike the others' (log of the factor, squared), which only matters where its own data say next to nothing. Joints are
scored one by one: each tries its options while the others try theirs, and what they chose together must be better.

A servo whose joint lacks its armature is as slow as one of a tenth of the gain, and a model made from a drawing lacks
it on every joint. So the usual effects of all joints are fitted, too, and the search begins with what leaves less.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, effects_at
from bumblebee.diagnosis.comparison import compare, walds
from bumblebee.diagnosis.estimation import Fit, gauss_newton, typical_power
from bumblebee.diagnosis.residuals import Problem, window_weights
from bumblebee.diagnosis.selection.changes import Asking, FarOff
from bumblebee.diagnosis.selection.proposals.all_joints import all_joints_of, begun_with
from bumblebee.diagnosis.selection.state import SearchState
from bumblebee.diagnosis.simulation import Windows, choose_starts, cut, residuals, vary
from bumblebee.diagnosis.thresholds.proposals import GainGrid
from bumblebee.sim.effects import Effect, single
from bumblebee.sim.servo import servos_of

_LEAST_FACTOR = 0.001
"""Smallest factor tried."""

KINDS = ("kp", "kd", "coulomb_friction")
Servo = tuple[float, float, float]
"""Factors on kp and kd, dry friction [N m]."""


@dataclass(frozen=True, eq=False)
class _Course:
    """Windows, weights and rules that servos are compared by."""

    problem: Problem
    windows: Windows
    names: tuple[str, ...]
    columns: np.ndarray
    """(S,) of the servos' joints among the logged ones."""
    limit: np.ndarray
    """(S,) the servos' torque limit [N m]."""

    @property
    def rule(self) -> GainGrid:
        """Thresholds: which servos are tried, and how they are compared."""
        return self.problem.thresholds.selection.proposals.gain_grid

    def scores(self, several: Sequence[Sequence[Servo]]) -> np.ndarray:
        """(V, S) score of every joint under each of V sets of servos; lower is better."""
        rule, p, part = self.rule, self.problem, self.problem.layout.slices["joint_pos"]
        models = [vary(p.plant, _effects(self.names, servos)) for servos in several]
        error = residuals(p.plant, p.layout, self.windows, models, p.coarse)[..., part][..., self.columns]
        noise = p.sigma[part][self.columns]
        square = np.where(np.isfinite(error), error, rule.diverged) ** 2
        score = np.log(square.mean(axis=2) + (rule.noise_factor * noise) ** 2).mean(axis=1)
        logs = np.log(np.maximum(np.array(several)[..., :2], _LEAST_FACTOR))
        return score + rule.unlike * ((logs - np.median(logs, axis=1, keepdims=True)) ** 2).sum(axis=2)


def gains_by_grid(problem: Problem, candidates: Sequence[Candidate]) -> list[tuple[Candidate, float]]:
    """Candidates of `KINDS` with values, all servos together.

    Empty where none makes the model much better, or where fewer than half of the servos are far off.

    Their steps are a tenth of the values: at a hundredth of the declared gain a tenth of it is no small change.
    """
    table = {(c.effect, c.where): c for c in candidates if c.effect in KINDS}
    names = tuple(where for effect, where in table if effect == "kp" and ("kd", where) in table)
    course = _course(problem, names) if names else None
    if course is None:
        return []
    rule = course.rule
    declared: list[Servo] = [(1.0, 1.0, table["coulomb_friction", where].nominal[0]) for where in names]
    servos = _shared(course, declared)
    for number, factors in enumerate(rule.sweeps, start=1):
        servos = _swept(course, servos, factors)
        if number == rule.decided_after and _share_wrong(servos, rule.nearly_wrong) < rule.nearly * rule.wrong_servos:
            return []
    before, after = course.scores([declared, servos]).mean(axis=1)
    if before - after < rule.least_fall or not _mostly_wrong(servos, rule):
        return []
    found = []
    for where, values, old in zip(names, servos, declared, strict=True):
        for effect, value, was in zip(KINDS, values, old, strict=True):
            if value != was:
                step = float(np.sign(value - was)) * rule.step * value
                found.append((replace(table[effect, where], step=(step,)), value))
    return found


def _mostly_wrong(servos: Sequence[Servo], rule: GainGrid) -> bool:
    """Whether at least half of the servos have a kp that is wrong by a factor of two.

    Else one effect may have carried the residuals that far away, and the search finds it better alone.
    """
    return _share_wrong(servos, rule.wrong_factor) >= rule.wrong_servos


def _share_wrong(servos: Sequence[Servo], factor: float) -> float:
    """Share of the servos whose kp is wrong by a factor or more."""
    return float(np.mean([abs(np.log(max(kp, 1e-12))) >= np.log(factor) for kp, _, _ in servos]))


def _course(problem: Problem, names: tuple[str, ...]) -> _Course | None:
    """Windows of a second of the fitted rollouts; None where these are shorter."""
    rule, windows, plant = problem.thresholds.selection.proposals.gain_grid, problem.windows, problem.plant
    ids = [int(i) for i in np.unique(windows.rollout)]
    starts = choose_starts(windows.source, ids, rule.span, rule.windows)
    if not starts:
        return None
    long = cut(plant, problem.layout, windows.source, starts, outputs=5)
    limit = servos_of(plant.model, [int(plant.model.joint(name).id) for name in names]).limit
    return _Course(problem, long, names, np.array([plant.joints.index(name) for name in names]), limit)


def _shared(course: _Course, declared: list[Servo]) -> list[Servo]:
    """The best of all factors on every servo's gains at once."""
    factors = itertools.product(course.rule.shared, course.rule.shared)
    options = [[(p, d, s[2]) for s in declared] for p, d in factors]
    return options[int(np.argmin(course.scores(options).mean(axis=1)))]


def _swept(course: _Course, servos: list[Servo], factors: Sequence[float]) -> list[Servo]:
    """Every servo at its best option, if that is better for all of them together."""
    options = [_options(s, factors, limit, course.rule) for s, limit in zip(servos, course.limit, strict=True)]
    sets = [servos, *([o[k] for o in options] for k in range(len(options[0])))]
    best = np.argmin(course.scores(sets), axis=0)
    chosen = [sets[k][j] for j, k in enumerate(best)]
    old, new = course.scores([servos, chosen]).mean(axis=1)
    return chosen if new < old else servos


def _options(servo: Servo, factors: Sequence[float], limit: float, rule: GainGrid) -> list[Servo]:
    """The servo with other gains and dry friction; `limit` is its torque limit [N m]."""
    kp, kd, dry = servo
    least, most = _LEAST_FACTOR, rule.most_dry * limit
    rub = limit if np.isfinite(limit) else max(dry, 1.0)
    out = [(max(kp * f, least), kd, dry) for f in factors]
    out += [(kp, max(kd * f, least), dry) for f in factors]
    out += [(max(kp * f, least), max(kd * f, least), dry) for f in factors]
    out += [(kp, kd, min(dry * f, most)) for f in factors]
    both = itertools.product((1.0, factors[0]), rule.dry_shares)
    return out + [(kp, max(kd * f, least), min(dry + rub * r, most)) for f, r in both]


def _effects(names: Sequence[str], servos: Sequence[Servo]) -> list[Effect]:
    return [
        single(kind, w, value) for w, s in zip(names, servos, strict=True) for kind, value in zip(KINDS, s, strict=True)
    ]


def far_gains(run: SearchState) -> Fit | None:
    """Servos far from the declared ones, where residuals are that large and the validation windows agree."""
    found = [] if typical_power(run.fit.residual) < run.config.far else gains_by_grid(run.problem, run.candidates)
    if not found:
        return None
    chosen, values = [c for c, _ in found], np.array([v for _, v in found])
    weights = window_weights(run.problem.residual([effects_at(chosen, values)])[0])
    fit = gauss_newton(run.problem, chosen, values, weights, iterations=0, coarse=True)
    gain = compare(run.problem, run.holdout, run.fit, fit)
    return fit if gain.passes(run.problem.thresholds.comparison.validation) else None


def start_with_gain_grid(run: SearchState) -> Asking[bool]:
    """Begin with servos far from the declared ones, or with the usual effects of all joints if that leaves less."""
    fit, rules = far_gains(run), run.problem.thresholds.comparison
    if fit is None:
        return False
    # What leaves as much as would call for another beginning is none.
    below = min(fit.power(run.problem), run.config.far)
    usual = yield from all_joints_of(run, below)
    if usual is not None and compare(run.problem, run.holdout, fit, usual).passes(rules.together):
        yield begun_with(run, usual)
        return True
    weights = window_weights(run.problem.residual([fit.effects])[0])
    yield FarOff(fit, walds(run.problem, fit, weights, fit.chosen))
    return True
