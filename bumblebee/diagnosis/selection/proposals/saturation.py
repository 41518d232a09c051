"""Actuator saturation: limits of torque, tried at many sizes on just the windows that they reach.

A limit acts in few windows: there it decides everything, elsewhere nothing. It has no slope where it does not reach,
the windows that it spoils weigh little in a fit, and they are too few for a variance between windows to call them
significant. So every limit is simulated at sizes that reach the hardest driven window, the next one, and so on, in fine
steps, for a servo that hits its limit a coarse step late errs by more than the limit does. Where the joint always
carries a load, torque limits below what any window asks for follow. Its gain is the fall of the
fit's robust cost, 2 s M log(1 + power / s) summed over windows with s their median power, of which
`problem.window_weights` are the weights.
"""

from collections.abc import Container, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from bumblebee.diagnosis.candidates import SATURATIONS, Candidate
from bumblebee.diagnosis.comparison import plausible
from bumblebee.diagnosis.estimation import Fit, LeftOver
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.changes import Asking, Vain
from bumblebee.diagnosis.selection.profile import halved, profile
from bumblebee.diagnosis.selection.proposals.joint_misfit import joint_chi_squares
from bumblebee.diagnosis.selection.trial import Trial
from bumblebee.diagnosis.simulation import Changes, Plant, Windows, command_inputs, plant_servos, vary
from bumblebee.diagnosis.thresholds.proposals import Saturation
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import Effect
from bumblebee.sim.servo import Servos


@dataclass(frozen=True, eq=False)
class _Demand:
    """Demand on the servos in each of W windows."""

    peak: np.ndarray
    """(W, J) largest torque asked for [N m]."""
    slowest: np.ndarray
    """(W, J) least inverse no-load speed [s/rad] that would have been felt; infinite where nothing would."""

    def reach(self, kind: str, j: int) -> np.ndarray:
        """Sizes (W,) from which on the windows feel a limit; what is hardest driven feels it first."""
        return -self.peak[:, j] if kind == "torque_limit" else self.slowest[:, j]


@dataclass(frozen=True, eq=False)
class _Limit:
    """One joint's limit, tried conditional on a fit."""

    problem: Problem
    fit: Fit
    clean: np.ndarray
    """(W, M) whitened residual of the fit."""
    usual: float
    """Median power of the windows, at least that of noise."""
    candidate: Candidate
    reach: np.ndarray
    """(W,) sizes from which on the windows feel it."""
    changes: Changes
    """Changes that were simulated before."""

    @property
    def rule(self) -> Saturation:
        """Thresholds that it is judged by."""
        return self.problem.thresholds.selection.proposals.saturation

    def value(self, size: float) -> float:
        """The fitted parameter of a size: the torque is the size with the other sign."""
        return -size if self.candidate.effect == "torque_limit" else size

    def gain(self, size: float, fresh: bool) -> float:
        """Fall of the robust cost; only windows that may feel the limit are simulated."""
        felt = self.reach <= size + self.rule.margin * abs(size)

        def simulate() -> np.ndarray:
            return _change(self.problem, self.fit, self.candidate, self.value(size), felt)[felt]

        key = (self.candidate.effect, size, felt.tobytes())
        left = self.clean[felt] - self.changes.get(self.fit.effects, self.candidate.where, key, simulate, fresh)
        before, after = (np.log1p((x**2).mean(axis=1) / self.usual) for x in (self.clean[felt], left))
        return float(2.0 * self.usual * self.clean.shape[1] * (before - after).sum())


def saturation_trials(
    problem: Problem,
    fit: Fit,
    candidates: Sequence[Candidate],
    weights: np.ndarray,
    hopeless: Container[tuple[str, str]],
    changes: Changes | None = None,
) -> Asking[list[Trial]]:
    """The limit that explains most of the windows with large residuals; none where no limit does.

    Of the four windows that a limit reaches first one must be off, and its joint in it, or it is not simulated. Where
    it acts in a few only it must bring them down to noise, which one number does not do by chance. One that only makes
    the windows worse that it reaches first is then among the `hopeless` (effect, place), which are not tried. `changes`
    are what was simulated before.
    """
    rule = problem.thresholds.selection.proposals.saturation
    clean = fit.clean(problem)
    power = (clean**2).mean(axis=1)
    usual = max(float(np.median(power)), 1.0)
    taken = {(c.effect, c.where) for c in fit.chosen}
    kinds = [c for c in candidates if c.effect in SATURATIONS and (c.effect, c.where) not in taken]
    kinds = [c for c in kinds if (c.effect, c.where) not in hopeless]
    odd = power > rule.odd_power
    if not odd.any() or not kinds:
        return []
    own_off, demand = _own_off(problem, clean, odd, usual), _demand(problem, fit.effects)
    changes = (changes or Changes()).on(problem.windows, problem.whitener)
    found = []
    for kind, where in dict.fromkeys((c.effect, c.where) for c in kinds):
        own, j = [c for c in kinds if (c.effect, c.where) == (kind, where)], problem.plant.joints.index(where)
        reach = demand.reach(kind, j)
        if not own_off[np.argsort(reach)[: rule.reached_first], j].any():
            continue
        best = _best(_Limit(problem, fit, clean, usual, own[0], reach, changes))
        if best is None:
            continue
        value, gain = best
        if gain <= 0:
            yield Vain(kind, where)
        if gain > rule.least_gain:
            found += _trial(problem, fit, weights, _nearest(own, value), value, reach)
    return sorted(found, key=lambda t: t.cost)[:1]


def _nearest(candidates: Sequence[Candidate], value: float) -> Candidate:
    return min(candidates, key=lambda c: abs(c.start[0] - value))


def _trial(
    problem: Problem, fit: Fit, weights: np.ndarray, candidate: Candidate, value: float, reach: np.ndarray
) -> list[Trial]:
    """The limit on all windows that it reaches, if it does there what a limit may do."""
    change = _change(problem, fit, candidate, value, np.isfinite(reach))
    if not plausible(fit.clean(problem), change, problem.thresholds.comparison.plausible):
        return []
    left_over = LeftOver(problem, fit, weights)
    return [Trial(candidate, np.array([value]), left_over.cost(fit.residual - change), left_over.left(change))]


def _own_off(problem: Problem, clean: np.ndarray, odd: np.ndarray, usual: float) -> np.ndarray:
    """(W, J) whether a window is `odd` (W,) and a joint's own readings in it are off: what its limit spoils first."""
    rule = problem.thresholds.selection.proposals.saturation
    out = np.zeros((len(clean), len(problem.plant.joints)), dtype=bool)
    own, freedom = joint_chi_squares(problem.part(odd), clean[odd])
    out[odd] = own / usual > chi2.isf(rule.noise_chance, freedom)
    return out


def _best(limit: _Limit) -> tuple[float, float] | None:
    """Value and gain of a limit; simulated anew if it looks well by what was simulated around an earlier fit."""
    limit.changes.taken = False
    best = _sought(limit)
    return _sought(limit, fresh=True) if best is not None and limit.changes.taken else best


def _sought(limit: _Limit, fresh: bool = False) -> tuple[float, float] | None:
    """Value and gain of the best of the sizes tried.

    None where no size is worth a closer look; no gain where all that were tried only do harm. What the limit's
    `changes` know of an earlier fit is taken for this one's, unless all is to be `fresh`: half of what is worth a look
    is enough for it.
    """
    rule, cost = limit.rule, limit.fit.cost

    def gain(size: float) -> float:
        return limit.gain(size, fresh)

    order = np.argsort(limit.reach)
    felt = limit.reach[order][np.isfinite(limit.reach[order])]
    counts = sorted({min(n, len(felt) - 1) for n in rule.reached if len(felt) >= 2} - {0})
    if not counts:
        return None
    sizes = [float(0.5 * (felt[n - 1] + felt[n])) for n in counts]
    if limit.candidate.effect == "torque_limit":
        sizes += [float(share * felt[-1]) for share in rule.below if felt[-1] < 0]

    def harmful(gains: Sequence[float]) -> bool:
        return len(gains) > 1 and max(gains[-2:]) < -2.0 * limit.usual * limit.clean.shape[1] * rule.harm

    def ends(gains: Sequence[float]) -> bool:
        """Smaller limits would spoil these windows further, and others."""
        enough = counts[min(len(gains), len(counts)) - 1] >= rule.enough_windows
        return harmful(gains) or (enough and max(gains) < rule.earlier_share * rule.promising_share * cost)

    series = profile(lambda sizes: [gain(s) for s in sizes], sizes, ends)
    if series.gain <= 0 and harmful(series.gains):
        return limit.value(series.size), 0.0
    earlier = limit.changes.taken and not fresh
    if series.gain <= (rule.earlier_share if earlier else 1.0) * rule.promising_share * cost:
        return None
    if earlier:
        return limit.value(series.size), series.gain
    size, most = halved(gain, series.around, series.gain, rule.halvings)
    return limit.value(size), most


def _change(problem: Problem, fit: Fit, candidate: Candidate, value: float, felt: np.ndarray) -> np.ndarray:
    """Change of the prediction (W, M) by a limit, simulated on the windows `felt` (W,) alone."""
    out = np.zeros_like(fit.residual)
    moved = [*fit.effects, candidate.at(candidate.clip([value]))]
    out[felt] = fit.residual[felt] - problem.on(np.flatnonzero(felt), moved)
    return out


def _demand(problem: Problem, effects: Sequence[Effect]) -> _Demand:
    """By the servos of the model with `effects`, at the logged states and commands."""
    windows, plant = problem.windows, problem.plant
    varied = vary(plant, effects)
    servos = [plant_servos(plant, model) for model in varied.models]
    conditions = dict(zip(windows.rollout.tolist(), windows.condition.tolist(), strict=True))
    tables = {i: _asked(plant, servos[c], windows.source[i]) for i, c in conditions.items()}
    peak = np.empty((len(windows), len(plant.joints)))
    slowest = np.empty_like(peak)
    for w, (i, first) in enumerate(zip(windows.rollout, windows.start, strict=True)):
        last = first + _ticks(windows, w)
        torque, inverse = tables[i]
        peak[w], slowest[w] = torque[first:last].max(axis=0), inverse[first:last].min(axis=0)
    return _Demand(peak, slowest)


def _ticks(windows: Windows, w: int) -> int:
    """Rows of the log that window `w` spans."""
    time = windows.source[windows.rollout[w]].time
    return max(
        1, int(np.searchsorted(time, time[windows.start[w]] + windows.out_time[w, -1] + 1e-9) - windows.start[w])
    )


def _asked(plant: Plant, servos: Servos, rollout: Rollout) -> tuple[np.ndarray, np.ndarray]:
    """Largest torque asked for (T, J) at each tick, and least inverse no-load speed (T, J) that would be felt there."""
    command = servos.controls(command_inputs(plant, rollout))
    held = np.concatenate((command[:1], command[:-1]))
    place, speed = rollout.joint_pos - plant.offset, rollout.joint_vel
    free = np.full(len(servos.dof), np.inf)
    peak, inverse = np.zeros_like(place), np.full_like(place, np.inf)
    for control in (held, command):
        asked = servos.torque(place, speed, control, free)
        drives = (asked * speed > 0) & np.isfinite(servos.limit)
        share = np.clip(1.0 - np.abs(asked) / servos.limit, 0.0, 1.0)
        felt = np.where(drives, share / np.maximum(np.abs(speed), 1e-6), np.inf)
        peak, inverse = np.maximum(peak, np.abs(asked)), np.minimum(inverse, felt)
    return peak, inverse
