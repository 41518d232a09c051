"""Limits of torque, tried at many sizes on just the windows that they reach.

A limit acts in few windows: there it decides everything, elsewhere nothing. It has no slope where it does not reach,
the windows that it spoils weigh little in a fit, and they are too few for a variance between windows to call them
significant. So every limit is simulated at sizes that reach the hardest driven window, the next one, and so on, in fine
steps, for a servo that hits its limit a coarse step late errs by more than the limit does. Its gain is the fall of the
fit's robust cost, 2 s M log(1 + power / s) summed over windows with s their median power, of which
`problem.window_weights` are the weights.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from bumblebee.diagnosis.candidates import SATURATIONS, Candidate
from bumblebee.diagnosis.comparison import plausible
from bumblebee.diagnosis.estimation import Fit, LeftOver
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.proposals.joint_misfit import joint_chi_squares
from bumblebee.diagnosis.selection.trial import Trial
from bumblebee.diagnosis.simulation import Changes, Plant, Windows, command_inputs, vary
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import Effect
from bumblebee.sim.servo import Servos, servos_of

_ODD, _FIRST = 1.6, 4  # power of a window that is off; windows that a limit reaches first
_CHANCE = 0.01  # that noise puts a joint's own readings of one window as far off
_WORTH, _SHARE = 15.0, 2e-3  # fall of the cost; share of it that a size must gain to be looked at closer
_REACHED = (1, 2, 4, 7, 12, 24, 50, 100, 200)  # windows that the sizes tried reach
_HOPELESS = 1.5  # rise of log(1 + power / s), summed, by each of two sizes from which on no more are tried
_ENOUGH = 12  # windows: where no size that reaches up to so many gains, no more are tried
_CLOSER = 5  # halvings of the interval around the best of them


@dataclass(frozen=True, eq=False)
class _Demand:
    """What the servos were asked for in each of W windows."""

    peak: np.ndarray
    """(W, J) largest torque asked for [N m]."""
    slowest: np.ndarray
    """(W, J) least inverse no-load speed [s/rad] that would have been felt; infinite where nothing would."""

    def reach(self, kind: str, j: int) -> np.ndarray:
        """Sizes (W,) from which on the windows feel a limit; what is hardest driven feels it first."""
        return -self.peak[:, j] if kind == "torque_limit" else self.slowest[:, j]


def limit_trials(
    problem: Problem,
    fit: Fit,
    candidates: Sequence[Candidate],
    weights: np.ndarray,
    hopeless: set[tuple[str, str]],
    changes: Changes | None = None,
) -> list[Trial]:
    """The limit that explains most of the windows that are far off; none where no limit does.

    Of the four windows that a limit reaches first one must be off, and its joint in it, or it is not simulated. Where
    it acts in a few only it must bring them down to noise, which one number does not do by chance. One that only makes
    the windows worse that it reaches first joins the `hopeless` (effect, place), which are not tried. `changes` are
    what was simulated before.
    """
    clean = fit.clean(problem)
    power = (clean**2).mean(axis=1)
    usual = max(float(np.median(power)), 1.0)
    taken = {(c.effect, c.where) for c in fit.chosen}
    kinds = [c for c in candidates if c.effect in SATURATIONS and (c.effect, c.where) not in taken | hopeless]
    odd = power > _ODD
    if not odd.any() or not kinds:
        return []
    own_off = _own_off(problem, clean, odd, usual)
    demand = _demand(problem, fit.effects)
    beside = LeftOver(problem, fit, weights)
    changes = (changes or Changes()).on(problem.windows, problem.whitener)
    found = []
    for kind, where in dict.fromkeys((c.effect, c.where) for c in kinds):
        own = [c for c in kinds if (c.effect, c.where) == (kind, where)]
        reach = demand.reach(kind, problem.plant.joints.index(where))
        if not own_off[np.argsort(reach)[:_FIRST], problem.plant.joints.index(where)].any():
            continue
        changes.taken = False
        best = _profile(problem, fit, clean, usual, own[0], reach, changes)
        if best is not None and changes.taken:
            best = _profile(problem, fit, clean, usual, own[0], reach, changes, fresh=True)
        if best is not None and best[1] <= 0:
            hopeless.add((kind, where))
        if best is not None and best[1] > _WORTH:
            nearest = min(own, key=lambda c: abs(c.start[0] - best[0]))
            change = _change(problem, fit, nearest, best[0], np.isfinite(reach))
            if not plausible(clean, change):
                continue
            found.append(Trial(nearest, np.array([best[0]]), beside.cost(fit.residual - change), beside.left(change)))
    return sorted(found, key=lambda t: t.cost)[:1]


def _own_off(problem: Problem, clean: np.ndarray, odd: np.ndarray, usual: float) -> np.ndarray:
    """(W, J) whether a window is `odd` (W,) and a joint's own readings in it are off: what its limit spoils first."""
    out = np.zeros((len(clean), len(problem.plant.joints)), dtype=bool)
    own, freedom = joint_chi_squares(problem.part(odd), clean[odd])
    out[odd] = own / usual > chi2.isf(_CHANCE, freedom)
    return out


def _profile(
    problem: Problem,
    fit: Fit,
    clean: np.ndarray,
    usual: float,
    candidate: Candidate,
    reach: np.ndarray,
    changes: Changes,
    fresh: bool = False,
) -> tuple[float, float] | None:
    """Size and gain of the best of the sizes tried, `reach` (W,) being where each window begins to feel it.

    None where no size is worth a closer look; no gain where all that were tried only do harm. What `changes` know of an
    earlier fit is taken for this one's, unless all is to be `fresh`: half of what is worth a look is enough for it.
    """

    def gain(size: float) -> float:
        return _gain(problem, fit, clean, usual, candidate, size, reach, changes, fresh)

    order = np.argsort(reach)
    felt = reach[order][np.isfinite(reach[order])]
    counts = sorted({min(n, len(felt) - 1) for n in _REACHED if len(felt) >= 2} - {0})
    if not counts:
        return None
    sizes = [float(0.5 * (felt[n - 1] + felt[n])) for n in counts]
    gains: list[float] = []
    for count, size in zip(counts, sizes, strict=True):
        gains.append(gain(size))
        harmful = len(gains) > 1 and max(gains[-2:]) < -2.0 * usual * clean.shape[1] * _HOPELESS
        if harmful or (count >= _ENOUGH and max(gains) < 0.5 * _SHARE * fit.cost):
            break  # smaller limits spoil these windows further, and others
    best = int(np.argmax(gains))
    if gains[best] <= 0 and harmful:
        return _value(candidate, sizes[best]), 0.0
    if gains[best] <= (0.5 if changes.taken and not fresh else 1.0) * _SHARE * fit.cost:
        return None
    if changes.taken and not fresh:
        return _value(candidate, sizes[best]), gains[best]
    low, high = sizes[max(best - 1, 0)], sizes[min(best + 1, len(gains) - 1)]
    at = _closer(gain, low, sizes[best], high, gains[best])
    return (_value(candidate, at[0]), at[1])


def _closer(gain: Callable[[float], float], low: float, middle: float, high: float, best: float) -> tuple[float, float]:
    """The best of a few more sizes, halving the wider side of the interval around the best so far."""
    for _ in range(_CLOSER):
        left = middle - low >= high - middle
        new = 0.5 * (low + middle) if left else 0.5 * (middle + high)
        value = gain(new)
        if value > best:
            low, middle, high, best = (low, new, middle, value) if left else (middle, new, high, value)
        elif left:
            low = new
        else:
            high = new
    return middle, best


def _value(candidate: Candidate, size: float) -> float:
    """The fitted parameter of a size: the torque is the size with the other sign."""
    return -size if candidate.effect == "torque_limit" else size


def _gain(
    problem: Problem,
    fit: Fit,
    clean: np.ndarray,
    usual: float,
    candidate: Candidate,
    size: float,
    reach: np.ndarray,
    changes: Changes,
    fresh: bool,
) -> float:
    """Fall of the robust cost; only windows that may feel the limit are simulated."""
    felt = reach <= size + 0.05 * abs(size)

    def simulate() -> np.ndarray:
        return _change(problem, fit, candidate, _value(candidate, size), felt)[felt]

    key = (candidate.effect, size, felt.tobytes())
    left = clean[felt] - changes.get(fit.effects, candidate.where, key, simulate, fresh)
    before, after = (np.log1p((x**2).mean(axis=1) / usual) for x in (clean[felt], left))
    return float(2.0 * usual * clean.shape[1] * (before - after).sum())


def _change(problem: Problem, fit: Fit, candidate: Candidate, value: float, felt: np.ndarray) -> np.ndarray:
    """What a limit does to the prediction (W, M), simulated on the windows `felt` (W,) alone."""
    out = np.zeros_like(fit.residual)
    moved = [*fit.effects, candidate.at(candidate.clip([value]))]
    out[felt] = fit.residual[felt] - problem.on(np.flatnonzero(felt), moved)
    return out


def _demand(problem: Problem, effects: Sequence[Effect]) -> _Demand:
    """By the servos of the model with `effects`, at the logged states and commands."""
    windows, plant = problem.windows, problem.plant
    varied = vary(plant, effects)
    own = varied.plant or plant
    servos = servos_of(varied.model, [int(own.model.joint(name).id) for name in plant.joints])
    tables = {i: _asked(plant, servos, windows.source[i]) for i in np.unique(windows.rollout)}
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
