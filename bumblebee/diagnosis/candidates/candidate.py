"""One effect in one place that the model may lack: its parameters, where they start, what changes of them matter."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bumblebee.diagnosis.candidates.traits import ABRUPT, INVERSE
from bumblebee.diagnosis.thresholds.candidates import CandidateLimits
from bumblebee.sim.effects import CATALOGUE, Effect, single


@dataclass(frozen=True)
class Candidate:
    """One effect on one place, with its parameters as the fit moves them (P,)."""

    effect: str
    where: str
    """A joint, body or geom; "" for the whole robot."""
    nominal: tuple[float, ...]
    """Where the effect is absent."""
    step: tuple[float, ...]
    """Changes that matter, in the parameters' units; of the sign that the effect usually has."""
    free: tuple[int, ...] = (0,)
    """Parameters that the effect is tested in; of the others those with a step shape it, from `nominal + step` on."""
    shape_scale: float = 0.0
    """A change of its shape that matters; 0: the shape is not fitted."""
    limits: CandidateLimits = field(default_factory=CandidateLimits, repr=False, compare=False)
    """How it is simulated and how far it may go."""

    @property
    def start(self) -> np.ndarray:
        """Parameters (P,) of a first trial."""
        return np.array(self.nominal) + np.array(self.step)

    @property
    def scales(self) -> np.ndarray:
        """Changes (P,) of the parameters that matter, all positive; 0 for those that are not fitted."""
        out = np.full(len(self.step), self.shape_scale) * (np.array(self.step) != 0)
        for i, p in enumerate(CATALOGUE[self.effect].parameters):
            out[i] = 0.0 if p.choice else p.matters * (out[i] > 0) or out[i]
        out[list(self.free)] = np.abs(np.array(self.step)[list(self.free)])
        return out

    def at(self, values: Sequence[float] | np.ndarray) -> Effect:
        """The effect with its parameters at `values` (P,), brought within bounds."""
        values = self.clip(values)
        if self.effect in INVERSE:
            values[0] = 1.0 / values[0]
        return single(self.effect, self.where, *values)

    def clip(self, values: Sequence[float] | np.ndarray) -> np.ndarray:
        """`values` within physical bounds."""
        kind = CATALOGUE[self.effect]
        low, high = kind.bounds(self.nominal, self.limits)
        if self.effect in INVERSE:
            # An infinitely stiff shaft cannot be simulated.
            low[0], high[0] = max(1.0 / high[0], self.limits.stiffest * abs(self.step[0])), 1.0 / low[0]
        return kind.physical(np.clip(np.asarray(values, dtype=float), low, high))

    def moved(self, index: int, steps: float) -> np.ndarray:
        """First-trial parameters with only the free one number `index` away from nominal, by so many steps."""
        values = np.array(self.nominal)
        shape = [i for i in range(len(values)) if i not in self.free]
        values[shape] = self.start[shape]
        values[self.free[index]] += steps * self.step[self.free[index]]
        return values


def label(c: Candidate) -> dict[str, Any]:
    """How the contract names a candidate."""
    return {"effect": c.effect, "where": [c.where] if c.where else []}


def is_simulated(c: Candidate, joints: int) -> bool:
    """Whether a candidate's column is simulated: where it is no torque, or where one can afford it to be exact."""
    column = CATALOGUE[c.effect].column
    return column == "simulated" or (column == "late" and (not c.where or joints <= c.limits.few_joints))


def shortlisted(c: Candidate, joints: int) -> bool:
    """Whether a candidate costs too much to be simulated on every joint: only those worst explained are tried."""
    return c.effect in ABRUPT or (CATALOGUE[c.effect].costly and joints > c.limits.few_joints)


def without(effects: Sequence[Effect], candidate: Candidate) -> list[Effect]:
    """`effects` less one of the candidate's kind on its place."""
    place = (candidate.where,) if candidate.where else ()
    return [e for e in effects if (e.effect, e.where) != (candidate.effect, place)]


def effects_at(chosen: Sequence[Candidate], values: np.ndarray) -> list[Effect]:
    """The chosen effects with their parameters at `values` (P,)."""
    out, at = [], 0
    for c in chosen:
        out.append(c.at(values[at : at + len(c.nominal)]))
        at += len(c.nominal)
    return out


def clipped(chosen: Sequence[Candidate], values: np.ndarray) -> np.ndarray:
    """Values (P,) of all chosen effects within their bounds."""
    out, at = values.copy(), 0
    for c in chosen:
        part = slice(at, at + len(c.nominal))
        out[part], at = c.clip(values[part]), part.stop
    return out


def absent(chosen: Sequence[Candidate]) -> np.ndarray:
    """Values (P,) at which the effects are absent; what shapes them is at its start: a mass takes its moments along."""
    return np.concatenate([c.moved(0, 0) for c in chosen]) if chosen else np.empty(0)
