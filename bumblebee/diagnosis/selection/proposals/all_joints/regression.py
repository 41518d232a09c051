"""Least squares of the lacking torque on candidates' torques, within bounds, by how far each joint moves."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from bumblebee.diagnosis.candidates import Candidate, absent
from bumblebee.diagnosis.sensitivities import LackingTorque
from bumblebee.sim.effects import CATALOGUE
from bumblebee.sim.servo import servos_of

PROPORTIONAL, DAMPING = "kp", "viscous_friction"
SCALES = ("motor_strength", PROPORTIONAL)
"""Effects that scale what a drive gives."""
_NOTHING = 1e-6
"""Share of a joint's lacking torque that is nothing."""


@dataclass(frozen=True, eq=False)
class Regressed:
    """Some of the candidates, by number."""

    chosen: tuple[int, ...]
    sizes: np.ndarray
    """(P,) in their steps."""
    left: np.ndarray
    """(N, nv) torque that they leave [N m], by how far each joint moves."""
    scale: np.ndarray
    """(nv,) of it, by which it is weighed."""

    @property
    def cost(self) -> float:
        """Sum of squares."""
        return float(((self.left / self.scale) ** 2).sum())


class Regression:
    """Fits of some of the candidates to lacking torques (W, S, nv).

    A drive's strength f is asked as what it takes of the torque that the motion asks, (1 - 1 / f) of it, and friction
    that goes with load by that torque too: as shares of the drive's own they would explain it away. A servo's kp is
    asked alike, of what its damping does not give. Damping may be less than none by as much as a servo has.
    """

    def __init__(self, lacking: LackingTorque, candidates: Sequence[Candidate], rounds: int) -> None:
        self._rounds, self._shape = rounds, (-1, lacking.asked.shape[-1])
        self._moving = lacking.moving().reshape(self._shape)
        self._torques = [self._flat(lacking.signatures.of(c)) for c in candidates]
        self._bounds = [_bounds(lacking, c) for c in candidates]
        asked, damped = lacking.asked.reshape(self._shape), lacking.damped().reshape(self._shape)
        for k, c in enumerate(candidates):
            own = self._torques[k]
            if c.effect in SCALES:
                of = asked - damped if c.effect == PROPORTIONAL else asked
                self._torques[k] = c.step[0] * np.where(own, of, 0.0)
            elif CATALOGUE[c.effect].standard == "drive":
                self._torques[k] = c.step[0] * np.sign(own) * np.abs(np.where(own, asked, 0.0))
        self._torques = [torques * self._moving for torques in self._torques]

    def fit(self, lacking: np.ndarray, chosen: Sequence[int], scale: np.ndarray | None = None) -> Regressed:
        """Fit some, by a scale or by that of what they leave."""
        wanted = lacking.reshape(self._shape) * self._moving
        least = _NOTHING * self._mean(wanted)
        torques = np.concatenate([self._torques[k] for k in chosen])
        low, high = np.concatenate([self._bounds[k] for k in chosen], axis=1)
        given, scale = scale is not None, self._scale(wanted, least) if scale is None else scale
        for _ in range(1 if given else self._rounds):
            basis, triangle = np.linalg.qr((torques / scale).reshape(len(torques), -1).T)
            sizes = lsq_linear(triangle, basis.T @ (wanted / scale).ravel(), (low, high), method="bvls").x
            left = wanted - np.tensordot(sizes, torques, axes=1)
            fit = Regressed(tuple(chosen), sizes, left, scale)
            scale = scale if given else self._scale(left, least)
        return replace(fit, scale=scale)

    def best(self, fit: Regressed, rest: Sequence[int]) -> tuple[int, float, float]:
        """The one that would take most away beside a fit: which, how much of what is left as noise, which share."""
        basis, _ = np.linalg.qr(self._columns(fit.chosen, fit.scale))
        left = (fit.left / fit.scale).ravel()
        left = left - basis @ (basis.T @ left)
        total, gains = left @ left, []
        for k in rest:
            own = self._columns([k], fit.scale)
            own = own - basis @ (basis.T @ own)
            gains.append(left @ own @ np.linalg.lstsq(own, left)[0])
        best = int(np.argmax(gains))
        return rest[best], gains[best] * left.size / total, gains[best] / total

    def _flat(self, torques: np.ndarray) -> np.ndarray:
        return torques.reshape(len(torques), *self._moving.shape)

    def _columns(self, chosen: Sequence[int], scale: np.ndarray) -> np.ndarray:
        torques = np.concatenate([self._torques[k] for k in chosen])
        return (torques / scale).reshape(len(torques), -1).T

    def _scale(self, left: np.ndarray, least: np.ndarray) -> np.ndarray:
        return np.maximum(self._mean(left), np.maximum(least, 1e-300))

    def _mean(self, left: np.ndarray) -> np.ndarray:
        """Mean sizes (nv,) where each joint moves."""
        return np.abs(left).sum(axis=0) / np.maximum(self._moving.sum(axis=0), 1e-12)


def own_damping(lacking: LackingTorque, joint: str) -> float:
    """A servo's kd [N m s/rad]; 0 where a drive has none."""
    model = lacking.problem.plant.model
    return max(-float(servos_of(model, [int(model.joint(joint).id)]).bias[0, 2]), 0.0)


def _bounds(lacking: LackingTorque, c: Candidate) -> np.ndarray:
    """Least and largest sizes (2, F) of a candidate's free parameters, in their steps."""
    free = list(c.free)
    ends = np.stack(CATALOGUE[c.effect].bounds(c.nominal, c.limits)) - absent([c])
    if c.effect == DAMPING:
        ends[0] -= own_damping(lacking, c.where)
    sizes = np.sort(ends[:, free] / np.array(c.step)[free], axis=0)
    return np.sort((1 - 1 / (1 + c.step[0] * sizes)) / c.step[0], axis=0) if c.effect in SCALES else sizes
