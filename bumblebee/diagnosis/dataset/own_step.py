"""Logs of a simulation of the declared model, told by its own time step: they have that step's error in them.

A robot moves in no steps, so the declared model is simulated in short ones. What a simulation in longer steps logged
differs from that by its integrator's error, which for stiff servos is many times the noise. The longer step is kept to
only where the logs show it: where it leaves much less of the declared model's error.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.dataset.time_steps import step_for, steps_of
from bumblebee.diagnosis.simulation import Layout, Plant, choose_starts, cut, residuals, vary
from bumblebee.diagnosis.thresholds.dataset import TimeSteps
from bumblebee.measured.rollout import Rollout


def agreed_steps(
    plant: Plant, declared: float, layout: Layout, rollouts: Sequence[Rollout], sigma: np.ndarray, rule: TimeSteps
) -> tuple[tuple[float, float], float, list[str]]:
    """Steps [s] as `steps_of` gives them, by the declared model's own step where the logs agree with it; and a note.

    Args:
        plant: the declared model.
        declared: its time step [s].
        layout: of its readings (D).
        rollouts: to be used, with readings as they are compared.
        sigma: (D,) their noise.
        rule: of the steps.
    """
    period = float(np.median(np.diff(rollouts[0].time)))
    usual = steps_of(period, declared, plant.model.nv, rule)
    own = step_for(period, declared, rule)
    if own <= usual[0][0] or abs(own / declared - 1) > rule.uneven:
        return *usual, []
    starts = choose_starts(rollouts, range(len(rollouts)), rule.own_horizon, rule.own_windows, plant.thresholds.windows)
    if not starts:
        return *usual, []
    windows = cut(plant, layout, rollouts, starts)
    left = [(residuals(plant, layout, windows, [vary(plant, [])], step)[0] / sigma) ** 2 for step in (own, usual[0][0])]
    finite = np.isfinite(left).all(axis=(0, 2, 3))
    if not finite.any() or left[0][finite].mean() > rule.own * left[1][finite].mean():
        return *usual, []
    note = f"the logs agree with the declared model in its own time steps of {1e3 * own:g} ms, as those of a simulation"
    return *steps_of(period, declared, plant.model.nv, replace(rule, fine=own, search=own)), [note]
