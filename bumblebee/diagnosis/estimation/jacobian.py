"""How the prediction changes with the chosen effects' parameters; what is known of that is not simulated again."""

from collections.abc import Sequence

import numpy as np

from bumblebee.diagnosis.candidates import Candidate, clipped, effects_at, rough
from bumblebee.diagnosis.estimation.fit import Fit
from bumblebee.diagnosis.residuals import Problem


def columns_at(
    problem: Problem,
    chosen: Sequence[Candidate],
    values: np.ndarray,
    scales: np.ndarray,
    coarse: bool,
    known: np.ndarray,
    at: np.ndarray,
    held: np.ndarray | bool = False,
) -> np.ndarray:
    """Sensitivities (P', W, M) per scale at `values`, by differences of a fifth of it, or of the room to the bounds.

    Those of `known` (P', W, M), whose values were `at` (P', P), hold as long as nothing near has moved far; NaN in `at`
    where nothing is known; those that are `held` (P',) hold wherever anything moves. `at` is brought up to date.
    """
    moving = np.flatnonzero(scales)
    if not len(moving):
        return np.empty((0, *problem.nuisance.shape[1:]))
    near = _near(problem, chosen)
    moved = np.abs(values - at) <= problem.thresholds.estimation.jacobian.moved * np.where(scales > 0, scales, np.inf)
    fresh = np.array([moved[k, near[i]].all() for k, i in enumerate(moving)])
    stale = np.flatnonzero(~(fresh | (held & np.isfinite(at).all(axis=1))))
    if not len(stale):
        return known
    sets, sizes = [], []
    for i in moving[stale]:
        there = values.copy()
        there[i] = _aside(chosen, values, int(i), 0.2 * scales[i])
        sizes.append((there[i] - values[i]) / scales[i] or np.inf)
        sets.append(effects_at(chosen, there))
    coarse = coarse and rough(c.effect for c in chosen)
    change = problem.differences(effects_at(chosen, values), sets, coarse)
    columns, at[stale] = known.copy(), values
    columns[stale] = change / np.array(sizes)[:, None, None]
    return columns


def _aside(chosen: Sequence[Candidate], values: np.ndarray, i: int, step: float) -> float:
    """Parameter `i` a step up or, where that is out of bounds, down; where both are, as far as one may go."""
    reached = []
    for sign in (1.0, -1.0):
        there = values.copy()
        there[i] += sign * step
        reached.append(float(clipped(chosen, there)[i]))
        if reached[-1] == there[i]:
            return reached[-1]
    return max(reached, key=lambda value: abs(value - values[i]))


def _near(problem: Problem, chosen: Sequence[Candidate]) -> np.ndarray:
    """(P, P) whether a parameter can change much of what another does: in one place, or if either has no one place."""
    places = [c.where for c in chosen for _ in c.nominal]
    return np.array([[a == b or not _local(problem, {a, b}) for b in places] for a in places], dtype=bool)


def _local(problem: Problem, places: set[str]) -> bool:
    """Whether all places are joints and bodies, not the whole robot or the ground."""
    return places <= {*problem.plant.joints, *problem.plant.bodies}


def taken_over(
    problem: Problem, chosen: Sequence[Candidate], values: np.ndarray, moving: np.ndarray, known: Fit | None
) -> tuple[np.ndarray, np.ndarray]:
    """Columns (P', W, M) of the parameters `moving` (P',) as a fit that is `known` has them, and where they hold.

    The second are the values (P', P) that they were computed at: NaN where it has none, or where an effect near has
    come or gone since.
    """
    columns = np.zeros((len(moving), *problem.nuisance.shape[1:]))
    at = np.full((len(moving), len(values)), np.nan)
    if known is None:
        return columns, at
    owner = [c for c in chosen for _ in c.nominal]
    ends = np.cumsum([len(c.nominal) for c in chosen]).tolist()
    changed = {c.where for c in set(chosen) ^ set(known.chosen)}
    if not _local(problem, changed):
        return columns, at
    row = {int(i): k for k, i in enumerate(np.flatnonzero(known.scales))}
    for k, i in enumerate(moving):
        c = owner[i]
        if c not in known.chosen or c.where in changed or not _local(problem, {c.where}):
            continue
        first = ends[chosen.index(c)] - len(c.nominal)
        columns[k] = known.columns[row[known.slices[known.chosen.index(c)].start + int(i) - first]]
        at[k] = values
        for other, end in zip(chosen, ends, strict=True):
            if other in known.chosen:
                at[k, end - len(other.nominal) : end] = known.of(other)
    return columns, at
