"""Standard parameters by linear regression on inverse dynamics: where a fit of a robot far from its model begins.

Far from the data a simulation of the declared model flies, and what holds it back wins: no strength at all, or friction
beyond all measure. On the measured motion torques are linear in the standard parameters (Atkeson, An and Hollerbach
1986), and one least-squares fit within bounds finds all of them. Every joint's friction and rotor are in it; others
come in one after the other: loads and springs at the drives' declared strengths, or strengths and friction that goes
with load at the links' declared masses. Both together have no scale: a drive of no strength on links of no mass
explains every log. What comes in must leave less by far in the simulator than every joint's alone. A drive declared far
too strong is always at its limit, and tells nothing: so drives are also taken to have been within their limits
everywhere, each by a scale that makes them be. How late commands are is a profile: what all effects together leave,
over the whole range. Noise in velocities makes rotors and friction look small and commands late, so a fit that begins
at none is asked first.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import chi2

from bumblebee.diagnosis.candidates import USUAL_OF_ROBOT, Candidate, absent, clipped, effects_at, is_chosen
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.proposals.all_joints.regression import (
    DAMPING,
    SCALES,
    Regressed,
    Regression,
    is_share,
    own_damping,
)
from bumblebee.diagnosis.sensitivities import LackingTorque, lacking_torque
from bumblebee.sim.effects import CATALOGUE, Effect

Begun = tuple[Sequence[Candidate], np.ndarray]
"""Effects and the values (P,) that their fit begins with."""
_GAIN = "kd"


def standard_parameters(problem: Problem, candidates: Sequence[Candidate], level: float) -> list[Begun]:
    """Effects and values of regressions on the fitted windows, of each set that `_sets` names.

    Each at no delay, and at the likeliest. False alarms of what comes in one after the other are held to `level`.
    Without any drive nothing says how heavy the links are. Empty where no joint moves.
    """
    declared, robot = lacking_torque(problem), [c for c in candidates if c.effect in USUAL_OF_ROBOT and not c.where]
    every, begun = [c for c in candidates if CATALOGUE[c.effect].standard], []
    within = replace(declared, within=True)
    for lacking in [declared, within] if within.largest_scales else [declared]:
        regression = Regression(lacking, every, problem.thresholds.selection.proposals.all_joints.rounds)
        for first, more in _sets(lacking, every):
            single = [k for k in more if len(every[k].free) == 1]
            for late in _delays(regression, [*first, *single], lacking, robot):
                fit = _chosen(regression, lacking, effects_at(robot, late), every, first, more, level)
                effects, values = _as_values(lacking, [every[k] for k in fit.chosen], fit.sizes, candidates)
                begun.append(([*effects, *robot], np.concatenate((values, late))))
    return [b for k, b in enumerate(begun) if not any(_same(b, other, robot) for other in begun[:k])]


def _same(one: Begun, other: Begun, robot: Sequence[Candidate]) -> bool:
    """Whether the same effects are late alike: nothing came to every joint's."""
    late = all(abs(one[1][-1] - other[1][-1]) < c.step[0] for c in robot)
    return set(one[0]) == set(other[0]) and late


def _sets(lacking: LackingTorque, every: Sequence[Candidate]) -> list[tuple[list[int], list[int]]]:
    """Which of `every` candidate there are from the start, and which may come in beside them.

    Every joint's alone; drives' strengths alone; every joint's beside drives' and, as the drives are declared, links'.
    Of a robot on the ground every joint's beside all strengths: no one of these makes a difference, and what its links
    weigh its legs do not tell.
    """
    first = [k for k, c in enumerate(every) if _is_first(c, lacking)]
    strengths = [k for k, c in enumerate(every) if c.effect == SCALES[0]]
    if lacking.problem.plant.floating:
        return [(first, []), (sorted({*first, *strengths}), [])] if first else []
    driven = (lacking.problem.plant.actuator >= 0).any()
    scales = ("drive", "link") if driven and not lacking.within else ("drive",)
    more = [[k for k, c in enumerate(every) if CATALOGUE[c.effect].standard in ("joint", of)] for of in scales]
    beside = [(first, [k for k in some if k not in first]) for some in more]
    return [s for s in ((first, []), (strengths, []), *beside) if s[0]] if first else []


def _chosen(
    regression: Regression,
    lacking: LackingTorque,
    late: Sequence[Effect],
    every: Sequence[Candidate],
    first: Sequence[int],
    more: Sequence[int],
    level: float,
) -> Regressed:
    """The `first` of all candidates, and those of `more` that come in beside them."""
    least, torque = lacking.problem.thresholds.comparison.validation.least_share, lacking.after(late)
    fit = regression.fit(torque, first)
    for most in sorted({len(every[k].free) for k in more}):  # few numbers first: a mass before a centre of mass
        rest = [k for k in more if len(every[k].free) <= most and _is_open(every[k], every, fit)]
        while rest:
            k, gain, share = regression.best(fit, rest)
            if share < least or gain < chi2.isf(level / (len(first) + len(more)), len(every[k].free)):
                break
            larger = regression.fit(torque, [*fit.chosen, k], fit.by)
            rest.remove(k)
            if larger.cost < (1 - least) * fit.cost:
                fit = regression.fit(torque, larger.chosen)
                rest = [r for r in rest if _is_open(every[r], every, fit)]
    return fit


def _delays(
    regression: Regression, among: Sequence[int], lacking: LackingTorque, robot: Sequence[Candidate]
) -> list[np.ndarray]:
    """None, and where what effects leave together is least over the whole range (1,), if that differs."""
    none = absent(robot)
    if [c.effect for c in robot] != ["command_delay"]:
        return [none]
    by = regression.fit(lacking.after(effects_at(robot, none)), among).by

    def left(delay: float) -> float:
        return regression.fit(lacking.after(effects_at(robot, np.array([delay]))), among, by).cost

    low, high = (float(end[0]) for end in CATALOGUE["command_delay"].bounds(robot[0].nominal, robot[0].limits))
    grid = np.linspace(low, high, lacking.problem.thresholds.selection.proposals.all_joints.delays)
    k = int(np.argmin([left(delay) for delay in grid]))
    ends = grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)]
    found = minimize_scalar(left, bounds=ends, method="bounded", options={"xatol": 0.1 * robot[0].step[0]}).x
    return [none, np.array([found])] if abs(found - none[0]) > robot[0].step[0] else [none]


def _is_open(c: Candidate, every: Sequence[Candidate], fit: Regressed) -> bool:
    chosen = [every[k] for k in fit.chosen]
    scaled = c.effect in SCALES and any(o.effect in SCALES and o.where == c.where for o in chosen)
    return not scaled and not is_chosen(c, chosen)


def _is_first(c: Candidate, lacking: LackingTorque) -> bool:
    """Whether every joint has it: its friction, its rotor, and a drive that is too strong its scale."""
    if c.effect == SCALES[0] and c.where in lacking.largest_scales:
        return True
    return CATALOGUE[c.effect].standard == "joint" and CATALOGUE[c.effect].usual == "joint"


def _as_values(
    lacking: LackingTorque, effects: Sequence[Candidate], sizes: np.ndarray, candidates: Sequence[Candidate]
) -> Begun:
    """Effects and values from sizes (P,) of their free parameters, those on a joint as its drive's scale says.

    Damping is told in its plainest form (`_plainest`).
    """
    own = np.split(sizes, np.cumsum([len(c.free) for c in effects])[:-1])
    scales = {
        c.where: 1.0 / (1.0 - c.step[0] * size[0]) for c, size in zip(effects, own, strict=True) if is_share(lacking, c)
    }
    found: dict[Candidate, np.ndarray] = {}
    for c, size in zip(effects, own, strict=True):
        found[c] = absent([c])
        found[c][list(c.free)] += scales.get(c.where, 1.0) * size * np.array(c.step)[list(c.free)]
    there = {(c.effect, c.where): c for c in candidates}
    for friction in [c for c in effects if c.effect == DAMPING]:
        servo = [there[kind, friction.where] for kind in (*SCALES, _GAIN) if (kind, friction.where) in there]
        if len(servo) == 3 and (declared := own_damping(lacking.problem, friction.where)):
            _plainest(found, friction, servo, declared)
    return list(found), clipped(list(found), np.concatenate(list(found.values())))


def _plainest(
    found: dict[Candidate, np.ndarray], friction: Candidate, servo: Sequence[Candidate], declared: float
) -> None:
    """Tell a servo's scale as its strength or as its kp, whichever leaves less damping over; less than none as its kd.

    Half the strength with friction for the damping that is lost are half the kp.
    """
    strength, proportional, gain = servo
    scale = float(found.get(strength, found.get(proportional, np.ones(1)))[0])
    whole = float(found.pop(friction)[0] - friction.nominal[0]) + declared * (scale if strength in found else 1.0)
    drive, own = min(((strength, scale * declared), (proportional, declared)), key=lambda o: abs(whole - o[1]))
    if found.pop(strength, None) is not None or found.pop(proportional, None) is not None:
        found[drive] = np.array([scale])
    more = whole - own
    found[friction if more >= 0 else gain] = np.array([friction.nominal[0] + more if more >= 0 else 1.0 + more / own])
