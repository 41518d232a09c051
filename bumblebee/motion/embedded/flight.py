"""In the air nothing holds the body's angular momentum up: the torso must pitch against what the legs do."""

from dataclasses import replace

import numpy as np

from bumblebee.motion.embedded.plan import FPS, Plan

PITCH_INERTIA = 2.5
"""Inertia of the upper body about the centre of mass, roughly [kg m^2]; an error only costs passes."""
SMOOTH, SMALL = 3e-4, 1e-3
"""Costs of jerk and angle of the correction against the moment that remains."""


def spare_moment(plan: Plan, moment: np.ndarray) -> Plan:
    """The plan with the pelvis' pitch changed so that less moment (T,) [N m] is missing where no foot carries.

    A least squares problem: PITCH_INERTIA * pitch'' = -moment in the air, a smooth change everywhere else, none at
    the ends of the clip.
    """
    count = len(moment)
    air = np.logical_not(plan.contact.any(axis=1))
    second = _differences(count, (1.0, -2.0, 1.0)) * FPS**2
    third = _differences(count - 1, (1.0, -2.0, 1.0)) @ _differences(count, (-1.0, 1.0)) * FPS**3
    rows = air[1:-1]
    system = np.vstack([PITCH_INERTIA * second[rows], SMOOTH * third * PITCH_INERTIA, SMALL * np.eye(count) * FPS**2])
    right = np.concatenate([-moment[1:-1][rows], np.zeros(len(third) + count)])
    inner = system[:, 2:-2]
    change = np.zeros(count)
    change[2:-2] = np.linalg.solve(inner.T @ inner, inner.T @ right)
    pelvis = plan.pelvis.copy()
    pelvis[:, 1] += change
    return replace(plan, pelvis=pelvis)


def _differences(count: int, stencil: tuple[float, ...]) -> np.ndarray:
    """The matrix of a difference stencil, (count - len + 1, count)."""
    rows = count - len(stencil) + 1
    matrix = np.zeros((rows, count))
    for offset, factor in enumerate(stencil):
        matrix[np.arange(rows), np.arange(rows) + offset] = factor
    return matrix
