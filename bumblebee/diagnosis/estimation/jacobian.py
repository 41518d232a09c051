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
    places = np.array([c.where for c in chosen for _ in c.nominal])
    local = np.isin(places, [*problem.plant.joints, *problem.plant.bodies])
    return (places[:, None] == places) | ~(local[:, None] & local)


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
    changed = {c.where for c in set(chosen) ^ set(known.chosen)}
    local = {*problem.plant.joints, *problem.plant.bodies}
    if not changed <= local:
        return columns, at
    rows = {int(i): k for k, i in enumerate(np.flatnonzero(known.scales))}
    owner = [(c, f) for c in chosen for f in range(len(c.nominal))]
    start = {c: part.start for c, part in zip(known.chosen, known.slices, strict=True)}
    there = np.array([c in start for c, _ in owner], dtype=bool)
    stood = np.array([known.values[start[c] + f] if c in start else np.nan for c, f in owner])
    for k, i in enumerate(moving):
        c, f = owner[i]
        if c in start and c.where not in changed and c.where in local:
            columns[k] = known.columns[rows[start[c] + f]]
            at[k] = np.where(there, stood, values)
    return columns, at
