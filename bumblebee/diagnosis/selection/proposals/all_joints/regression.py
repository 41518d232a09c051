"""Least squares of the lacking torque on candidates' torques, within bounds, by how far each joint moves."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from bumblebee.diagnosis.candidates import Candidate, absent
from bumblebee.diagnosis.residuals import Problem
from bumblebee.diagnosis.sensitivities import LackingTorque, basis_of, without
from bumblebee.sim.effects import CATALOGUE
from bumblebee.sim.servo import servos_of

PROPORTIONAL, DAMPING = "kp", "viscous_friction"
SCALES = ("motor_strength", PROPORTIONAL)
"""Effects that scale what a drive gives."""
_NOTHING = 1e-6
"""Share of the lacking torque that is nothing."""


@dataclass(frozen=True, eq=False)
class Weighed:
    """All candidates' torques by how far each joint moves and by a scale, less what the ground may do."""

    weights: np.ndarray
    """(N, nv) [1/(N m)]."""
    ground: np.ndarray
    """(N, nv, M) orthogonal, zeros where the ground can do less."""
    columns: np.ndarray
    """(N nv, P)."""

    def target(self, torque: np.ndarray) -> np.ndarray:
        """Torque (N, nv) alike, (N nv,)."""
        return without((torque * self.weights)[..., None], self.ground).ravel()


@dataclass(frozen=True, eq=False)
class Regressed:
    """Some of the candidates, by number."""

    chosen: tuple[int, ...]
    sizes: np.ndarray
    """(P,) in their steps."""
    left: np.ndarray
    """(N nv,) that they leave, weighed."""
    by: Weighed

    @property
    def cost(self) -> float:
        """Sum of squares."""
        return float((self.left**2).sum())


class Regression:
    """Fits of some of the candidates to lacking torques (W, S, nv).

    A drive's strength f is asked as what it takes of the torque that the motion asks, (1 - 1 / f) of it, and friction
    that goes with load by that torque too: as shares of the drive's own they would explain it away. A servo's kp is
    asked alike, of what its damping does not give. Where the ground pushes nobody knows what the motion asks of a leg,
    and its drive's own torque it is. Damping may be less than none by as much as a servo has. Of drives
    that are taken to be within their limits no scale is larger than that allows.
    """

    def __init__(self, lacking: LackingTorque, candidates: Sequence[Candidate], rounds: int) -> None:
        self._rounds, self._shape = rounds, (-1, lacking.moved.shape[-1])
        self._moving = lacking.moving().reshape(self._shape)
        self._ground = lacking.ground.reshape(*self._moving.shape, -1)
        self._torques = [self._flat(lacking.signatures.of(c)) for c in candidates]
        self._bounds = [_bounds(lacking, c) for c in candidates]
        asked, damped = lacking.asked.reshape(self._shape), lacking.damped().reshape(self._shape)
        for k, c in enumerate(candidates):
            own = self._torques[k]
            if lacking.problem.plant.floating:
                continue
            if c.effect in SCALES:
                of = asked - damped if c.effect == PROPORTIONAL else asked
                self._torques[k] = c.step[0] * np.where(own, of, 0.0)
            elif CATALOGUE[c.effect].standard == "drive":
                self._torques[k] = c.step[0] * np.sign(own) * np.abs(np.where(own, asked, 0.0))
        ends = np.cumsum([0, *(len(torques) for torques in self._torques)])
        self._columns = [np.arange(*two) for two in itertools.pairwise(ends)]

    def fit(self, lacking: np.ndarray, chosen: Sequence[int], by: Weighed | None = None) -> Regressed:
        """Fit some, weighed as given, or by what they leave."""
        wanted = lacking.reshape(self._shape)
        rounds, by = (1, by) if by else (self._rounds, self._weighed(wanted * self._moving))
        low, high = np.concatenate([self._bounds[k] for k in chosen], axis=1)
        for number in range(rounds):
            columns, target = by.columns[:, self._of(chosen)], by.target(wanted)
            basis, triangle = np.linalg.qr(columns)
            sizes = lsq_linear(triangle, basis.T @ target, (low, high), method="bvls").x
            left = target - columns @ sizes
            fit = Regressed(tuple(chosen), sizes, left, by)
            if number < rounds - 1:
                by = self._weighed(left.reshape(self._shape) * self._moving / np.maximum(by.weights, 1e-300))
        return fit

    def best(self, fit: Regressed, rest: Sequence[int]) -> tuple[int, float, float]:
        """The one that would take most away beside a fit: which, how much of what is left as noise, which share."""
        basis, _ = np.linalg.qr(fit.by.columns[:, self._of(fit.chosen)])
        left = fit.left - basis @ (basis.T @ fit.left)
        total, gains = left @ left, []
        for k in rest:
            own = fit.by.columns[:, self._columns[k]]
            own = own - basis @ (basis.T @ own)
            gains.append(left @ own @ np.linalg.lstsq(own, left)[0])
        best = int(np.argmax(gains))
        return rest[best], gains[best] * left.size / total, gains[best] / total

    def _flat(self, torques: np.ndarray) -> np.ndarray:
        return torques.reshape(len(torques), *self._moving.shape)

    def _of(self, chosen: Sequence[int]) -> np.ndarray:
        return np.concatenate([self._columns[k] for k in chosen])

    def _weighed(self, left: np.ndarray) -> Weighed:
        """By mean sizes of torques (N, nv) where each joint moves."""
        mean = np.abs(left).sum(axis=0) / np.maximum(self._moving.sum(axis=0), 1e-12)
        weights = self._moving / np.maximum(mean, max(_NOTHING * float(mean.max()), 1e-300))
        ground = basis_of(self._ground * weights[..., None])
        torques = np.concatenate(self._torques).transpose(1, 2, 0) * weights[..., None]
        return Weighed(weights, ground, without(torques, ground).reshape(-1, torques.shape[-1]))


def is_share(lacking: LackingTorque, c: Candidate) -> bool:
    """Whether a drive's scale is asked as a share of what the motion asks, not of what the drive gives."""
    return c.effect in SCALES and not lacking.problem.plant.floating


def own_damping(problem: Problem, joint: str) -> float:
    """A servo's kd [N m s/rad]; 0 where a drive has none."""
    model = problem.plant.model
    return max(-float(servos_of(model, [int(model.joint(joint).id)]).bias[0, 2]), 0.0)


def _bounds(lacking: LackingTorque, c: Candidate) -> np.ndarray:
    """Least and largest sizes (2, F) of a candidate's free parameters, in their steps."""
    free = list(c.free)
    ends = np.stack(CATALOGUE[c.effect].bounds(c.nominal, c.limits)) - absent([c])
    if c.effect == DAMPING:
        ends[0] -= own_damping(lacking.problem, c.where)
    if c.effect in SCALES:
        ends[1] = np.minimum(ends[1], lacking.largest_scales.get(c.where, np.inf) - absent([c]))
    sizes = np.sort(ends[:, free] / np.array(c.step)[free], axis=0)
    return np.sort((1 - 1 / (1 + c.step[0] * sizes)) / c.step[0], axis=0) if is_share(lacking, c) else sizes
