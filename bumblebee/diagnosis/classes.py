"""Effects that these data cannot tell apart, and the smallest effects that they could have shown."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from bumblebee.diagnosis.candidates import Candidate
from bumblebee.diagnosis.problem import Problem
from bumblebee.diagnosis.search import Search
from bumblebee.sim.effects import CATALOGUE

_SAME = 0.95
_POWER_Z = 4.0  # seen four times out of five at a bound of about three standard errors


def equivalents(problem: Problem, candidates: Sequence[Candidate], found: Search) -> list[list[dict[str, Any]]]:
    """For each chosen effect the others whose whitened sensitivities point the same way (|cos| > 0.95)."""
    extra = [
        Candidate(kind, c.where, 1.0, 0.1)
        for c in found.fit.chosen
        for kind in ("kp", "kd")
        if CATALOGUE[c.effect].on == "joint" and problem.plant.actuator[problem.plant.joints.index(c.where)] >= 0
    ]
    extra = [e for e in dict.fromkeys(extra) if not problem.plant.torque_input]
    more = problem.sensitivities(extra) if extra else np.empty((0, *found.columns.shape[1:]))
    root = np.sqrt(found.weights)[:, None]
    every = [*candidates, *extra]
    flat = np.concatenate((found.columns, more)) * root
    flat = flat.reshape(len(flat), -1)
    norms = np.maximum(np.linalg.norm(flat, axis=1), 1e-12)
    out = []
    for c in found.fit.chosen:
        own = candidates.index(c)
        cosines = flat @ flat[own] / (norms * norms[own])
        same = [
            {"effect": every[k].effect, "where": [every[k].where]}
            for k in np.argsort(-np.abs(cosines))
            if k != own and abs(cosines[k]) > _SAME
        ]
        out.append(same)
    return out


def detectable(candidates: Sequence[Candidate], found: Search) -> list[dict[str, Any]]:
    """The change of each effect not found that these data would have shown, in the parameter's unit."""
    entries = []
    for c, (_, error) in zip(candidates, found.tests, strict=True):
        if c in found.fit.chosen:
            continue
        size = _POWER_Z * error * abs(c.step)
        kind = CATALOGUE[c.effect]
        entries.append(
            {
                "effect": c.effect,
                "where": [c.where],
                "parameter": kind.parameter,
                "change": float(size) if np.isfinite(size) else None,
                "unit": kind.unit,
            }
        )
    return entries
