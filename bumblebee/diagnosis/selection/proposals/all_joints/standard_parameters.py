"""Standard parameters by linear regression on inverse dynamics: where a fit of a robot that is told torques begins.

Far from the data a simulation of the declared model flies, and what holds it back wins: no strength at all, or friction
beyond all measure. On the measured motion torques are linear in the standard parameters (Atkeson, An and Hollerbach
1986), and one least-squares fit within bounds finds all of them. Every joint's friction and rotor are in it; others
come in one after the other: loads and springs at the drives' declared strengths, or strengths and friction that goes
with load at the links' declared masses. Both together have no scale: a drive of no strength on links of no mass
explains every log. A drive's strength f is asked as what it takes of the torque that the motion asks, (1 - 1 / f) of
it, and friction that goes with load by that torque too: as shares of the drive's own they would explain it away.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear
from scipy.stats import chi2

from bumblebee.diagnosis.candidates import USUAL_OF_ROBOT, Candidate, absent, clipped, is_chosen
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.selection.proposals.all_joints.begun import Begun
from bumblebee.diagnosis.sensitivities import LackingTorque, lacking_torque
from bumblebee.sim.effects import CATALOGUE

_STRENGTH = "motor_strength"
_NOTHING = 1e-6
"""Share of a joint's lacking torque that is nothing."""


def standard_parameters(problem: Problem, candidates: Sequence[Candidate], level: float) -> list[Begun]:
    """Effects and values of regressions on the fitted windows, beside those of drives and beside those of links.

    False alarms of what comes in one after the other are held to `level`. What else every robot has, a delay, begins
    at none. None where no joint moves.
    """
    lacking, robot = lacking_torque(problem), [c for c in candidates if c.effect in USUAL_OF_ROBOT and not c.where]
    every = ([c for c in candidates if CATALOGUE[c.effect].standard in ("joint", k)] for k in ("drive", "link"))
    begun = (_beside(problem, some, lacking, level) for some in every if any(map(_is_first, some)))
    return [([*chosen, *robot], np.concatenate((values, absent(robot)))) for chosen, values in begun]


def _beside(problem: Problem, every: Sequence[Candidate], lacking: LackingTorque, level: float) -> Begun:
    """The joints' effects, and of `every` those that come in beside them."""
    regression = _Regression(lacking, every, problem.thresholds.selection.proposals.all_joints.rounds)
    least = problem.thresholds.comparison.validation.least_share
    chosen = [k for k, c in enumerate(every) if _is_first(c)]
    fit = regression.fit(chosen)
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
    return _as_values([every[k] for k in fit.chosen], fit.sizes)


def _is_open(c: Candidate, every: Sequence[Candidate], fit: "_Fit") -> bool:
    return not is_chosen(c, [every[k] for k in fit.chosen])


def _is_first(c: Candidate) -> bool:
    """Whether every joint has it: its friction, its rotor."""
    return CATALOGUE[c.effect].standard == "joint" and CATALOGUE[c.effect].usual == "joint"


def _as_values(effects: Sequence[Candidate], sizes: np.ndarray) -> Begun:
    """Effects and values from sizes (P,) of their free parameters, those on a joint as its drive's strength says."""
    ends = np.cumsum([len(c.free) for c in effects])
    own = np.split(sizes, ends[:-1])
    shares = {c.where: c.step[0] * size[0] for c, size in zip(effects, own, strict=True) if c.effect == _STRENGTH}
    values = []
    for c, size in zip(effects, own, strict=True):
        strength, value = 1.0 / (1.0 - shares.get(c.where, 0.0)), absent([c])
        value[list(c.free)] += strength * size * np.array(c.step)[list(c.free)]
        values.append(value)
    return effects, clipped(effects, np.concatenate(values))


@dataclass(frozen=True, eq=False)
class _Fit:
    """Some of the candidates, by number."""

    chosen: tuple[int, ...]
    sizes: np.ndarray
    """(P,) in their steps."""
    left: np.ndarray
    """(N, nv) torque that they leave [N m]."""
    scale: np.ndarray
    """(nv,) of it, by which it is weighed."""

    @property
    def cost(self) -> float:
        return float(((self.left / self.scale) ** 2).sum())


class _Regression:
    """Least squares of the lacking torque on candidates' torques, within bounds."""

    def __init__(self, lacking: LackingTorque, candidates: Sequence[Candidate], rounds: int) -> None:
        self._rounds = rounds
        self._lacking = lacking.torque.reshape(-1, lacking.torque.shape[-1])
        self._torques = [
            torque.reshape(len(torque), *self._lacking.shape) for torque in map(lacking.signatures.of, candidates)
        ]
        self._bounds = [_bounds(c) for c in candidates]
        for k, c in enumerate(candidates):
            if CATALOGUE[c.effect].standard == "drive":
                own = self._torques[k]
                asked = np.where(own, lacking.asked.reshape(self._lacking.shape), 0.0)
                self._torques[k] = c.step[0] * (asked if c.effect == _STRENGTH else np.sign(own) * np.abs(asked))
            if c.effect == _STRENGTH:
                self._bounds[k] = np.sort((1 - 1 / (1 + c.step[0] * self._bounds[k])) / c.step[0], axis=0)

    def fit(self, chosen: Sequence[int], scale: np.ndarray | None = None) -> _Fit:
        """Fit some, by a scale or by that of what they leave."""
        torques = np.concatenate([self._torques[k] for k in chosen])
        low, high = np.concatenate([self._bounds[k] for k in chosen], axis=1)
        given, scale = scale is not None, self._scale(self._lacking) if scale is None else scale
        for _ in range(1 if given else self._rounds):
            basis, triangle = np.linalg.qr((torques / scale).reshape(len(torques), -1).T)
            sizes = lsq_linear(triangle, basis.T @ (self._lacking / scale).ravel(), (low, high)).x
            left = self._lacking - np.tensordot(sizes, torques, axes=1)
            fit = _Fit(tuple(chosen), sizes, left, scale)
            scale = scale if given else self._scale(left)
        return replace(fit, scale=scale)

    def best(self, fit: _Fit, rest: Sequence[int]) -> tuple[int, float, float]:
        """The one that would take most away beside a fit: which, how much of what is left as noise, which share."""
        basis, _ = np.linalg.qr(self._flat(fit.chosen, fit.scale))
        left = (fit.left / fit.scale).ravel()
        left = left - basis @ (basis.T @ left)
        total, gains = left @ left, []
        for k in rest:
            own = self._flat([k], fit.scale)
            own = own - basis @ (basis.T @ own)
            gains.append(left @ own @ np.linalg.lstsq(own, left)[0])
        best = int(np.argmax(gains))
        return rest[best], gains[best] * left.size / total, gains[best] / total

    def _flat(self, chosen: Sequence[int], scale: np.ndarray) -> np.ndarray:
        torques = np.concatenate([self._torques[k] for k in chosen])
        return (torques / scale).reshape(len(torques), -1).T

    def _scale(self, left: np.ndarray) -> np.ndarray:
        """Median sizes (nv,) of what is left: friction at the turn of a motion is not linear."""
        least = _NOTHING * np.median(np.abs(self._lacking), axis=0)
        return np.maximum(np.median(np.abs(left), axis=0), np.maximum(least, 1e-300))


def _bounds(c: Candidate) -> np.ndarray:
    """Least and largest sizes (2, F) of a candidate's free parameters, in their steps."""
    free = list(c.free)
    ends = np.stack(CATALOGUE[c.effect].bounds(c.nominal, c.limits)) - absent([c])
    return np.sort(ends[:, free] / np.array(c.step)[free], axis=0)
