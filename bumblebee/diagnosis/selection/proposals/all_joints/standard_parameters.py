"""Standard parameters by linear regression on inverse dynamics: where a fit of a robot on a fixed base begins.

Far from the data a simulation of the declared model flies, and what holds it back wins: no strength at all, or friction
beyond all measure. On the measured motion torques are linear in the standard parameters (Atkeson, An and Hollerbach
1986), and one least-squares fit within bounds finds all of them. Every joint's friction and rotor are in it; others
come in one after the other: loads and springs at the drives' declared strengths, or strengths and friction that goes
with load at the links' declared masses. Both together have no scale: a drive of no strength on links of no mass
explains every log. How late commands are is a profile: what all effects together leave, over the whole range. Noise in
velocities makes rotors and friction look small and commands late, so a fit that begins at none is asked first.
"""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import chi2

from bumblebee.diagnosis.candidates import USUAL_OF_ROBOT, Candidate, absent, clipped, effects_at, is_chosen
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.proposals.all_joints.begun import Begun
from bumblebee.diagnosis.selection.proposals.all_joints.regression import (
    DAMPING,
    SCALES,
    STRENGTH,
    Regressed,
    Regression,
    own_damping,
)
from bumblebee.diagnosis.sensitivities import LackingTorque, lacking_torque
from bumblebee.sim.effects import CATALOGUE

_GAIN = "kd"
_GRID = 11
"""Delays at which the profile begins."""


def standard_parameters(problem: Problem, candidates: Sequence[Candidate], level: float) -> list[Begun]:
    """Effects and values of regressions on the fitted windows, beside those of drives and beside those of links.

    Each at no delay, and at the likeliest. False alarms of what comes in one after the other are held to `level`.
    Without any drive nothing says how heavy the links are. Empty where no joint moves.
    """
    lacking, robot = lacking_torque(problem), [c for c in candidates if c.effect in USUAL_OF_ROBOT and not c.where]
    gains, begun = {c.where: c for c in candidates if c.effect == _GAIN}, []
    driven = bool((problem.plant.actuator >= 0).any())
    for scale in ("drive", "link") if driven else ("drive",):
        every = [c for c in candidates if CATALOGUE[c.effect].standard in ("joint", scale)]
        if not any(map(_is_first, every)):
            continue
        regression = Regression(lacking, every, problem.thresholds.selection.proposals.all_joints.rounds)
        for late in _delays(regression, every, lacking, robot):
            fit = _chosen(regression.of(lacking.after(effects_at(robot, late))), problem, every, level)
            effects, values = _as_values(lacking, [every[k] for k in fit.chosen], fit.sizes, gains)
            begun.append(([*effects, *robot], np.concatenate((values, late))))
    return [b for k, b in enumerate(begun) if not any(_same(b, other) for other in begun[:k])]


def _same(one: Begun, other: Begun) -> bool:
    """Whether the same effects are late alike: rows of drives and of links to which nothing came."""
    return set(one[0]) == set(other[0]) and one[1][-1] == other[1][-1]


def _chosen(regression: Regression, problem: Problem, every: Sequence[Candidate], level: float) -> Regressed:
    """The joints' effects, and of `every` those that come in beside them."""
    least = problem.thresholds.comparison.validation.least_share
    fit = regression.fit([k for k, c in enumerate(every) if _is_first(c)])
    for most in sorted({len(c.free) for c in every}):  # few numbers first: a mass before a centre of mass
        rest = [k for k, c in enumerate(every) if len(c.free) <= most and _is_open(c, every, fit)]
        while rest:
            k, gain, share = regression.best(fit, rest)
            if share < least or gain < chi2.isf(level / len(every), len(every[k].free)):
                break
            larger = regression.fit([*fit.chosen, k], fit.scale)
            rest.remove(k)
            if larger.cost < (1 - least) * fit.cost:
                fit = regression.fit(larger.chosen)
                rest = [r for r in rest if _is_open(every[r], every, fit)]
    return fit


def _delays(
    regression: Regression, every: Sequence[Candidate], lacking: LackingTorque, robot: Sequence[Candidate]
) -> list[np.ndarray]:
    """None, and where what all effects leave is least over the whole range (1,), if that differs."""
    if [c.effect for c in robot] != ["command_delay"]:
        return [absent(robot)]
    simple = [k for k, c in enumerate(every) if len(c.free) == 1]

    def left(delay: float) -> float:
        fit = regression.of(lacking.after(effects_at(robot, np.array([delay])))).fit(simple)
        return float(np.log(fit.scale).sum())

    low, high = (float(end[0]) for end in CATALOGUE["command_delay"].bounds(robot[0].nominal, robot[0].limits))
    grid = np.linspace(low, high, _GRID)
    k = int(np.argmin([left(delay) for delay in grid]))
    ends = grid[max(k - 1, 0)], grid[min(k + 1, _GRID - 1)]
    found = np.array(
        [minimize_scalar(left, bounds=ends, method="bounded", options={"xatol": 0.1 * robot[0].step[0]}).x]
    )
    none = absent(robot)
    return [none, found] if abs(found[0] - none[0]) > robot[0].step[0] else [none]


def _is_open(c: Candidate, every: Sequence[Candidate], fit: Regressed) -> bool:
    chosen = [every[k] for k in fit.chosen]
    scaled = c.effect in SCALES and any(o.effect in SCALES and o.where == c.where for o in chosen)
    return not scaled and not is_chosen(c, chosen)


def _is_first(c: Candidate) -> bool:
    """Whether every joint has it: its friction, its rotor."""
    return CATALOGUE[c.effect].standard == "joint" and CATALOGUE[c.effect].usual == "joint"


def _as_values(
    lacking: LackingTorque, effects: Sequence[Candidate], sizes: np.ndarray, gains: dict[str, Candidate]
) -> Begun:
    """Effects and values from sizes (P,) of their free parameters, those on a joint as its drive's scale says.

    Damping below what is declared is a lower kd.
    """
    own = np.split(sizes, np.cumsum([len(c.free) for c in effects])[:-1])
    scales = {
        c.where: (c.effect, 1.0 / (1.0 - c.step[0] * size[0]))
        for c, size in zip(effects, own, strict=True)
        if c.effect in SCALES
    }
    chosen, values = [], []
    for c, size in zip(effects, own, strict=True):
        kind, scale = scales.get(c.where, ("", 1.0))
        value = absent([c])
        value[list(c.free)] += scale * size * np.array(c.step)[list(c.free)]
        less = value[0] - c.nominal[0]
        if c.effect == DAMPING and less < 0 and own_damping(lacking, c.where) and c.where in gains:
            kd = (scale if kind == STRENGTH else 1.0) * own_damping(lacking, c.where)
            c, value = gains[c.where], np.array([1.0 + less / kd])
        chosen.append(c)
        values.append(value)
    return chosen, clipped(chosen, np.concatenate(values))
