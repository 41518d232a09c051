"""Directions in which two correct simulators differ: a fit must be free to move along them without naming an effect.

Truth comes from a robot, or from another integrator at another step. What such a difference does is of first order in
the step and the same for every joint, so each kind is one column with one coefficient for the whole dataset:

- integrator: this simulation at its step against itself at twice the step; of Runge and Kutta's method, which makes
  hardly an error, against one of first order at the same step;
- position loop and velocity loop: the servo acts on readings that are a little old, q(t - e) and qd(t - e);
- velocity clock: velocities are read a little before positions;
- height, only where the base's height is not measured but taken from stance: all heights shifted, 1 for a millimetre.

A coefficient of 1 stands for one millisecond; that is also its prior's standard deviation. A problem has one nuisance
more, the curvature of the start's noise (`whiten`).
"""

import copy
from dataclasses import replace

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation import Layout, Plant, Starts, Variation, Windows, residuals
from bumblebee.diagnosis.thresholds.residuals import Nuisances

_LEAST_ARMATURE = 0.1
"""Share of a joint's armature that a late velocity loop leaves at least: of a small one it would take all."""

NAMES = ("integrator", "position_loop", "velocity_loop", "velocity_clock", "height")


def nuisance_columns(
    plant: Plant, layout: Layout, windows: Windows, variation: Variation, step: float, rule: Nuisances | None = None
) -> np.ndarray:
    """Change of the prediction for coefficient 1 of each nuisance, (4 or 5, W, N, D); diverged windows are NaN."""
    rule, ticks = rule or Nuisances(), windows.out_time
    # One simulation, read at the ticks, a little before them, and just after the start.
    every = residuals(plant, layout, _read_thrice(windows, 2 * step, rule.unit), [variation], step)[0]
    base, early, first = np.split(every, [ticks.shape[1], 2 * ticks.shape[1]], axis=1)
    double = residuals(plant, layout, windows, [variation], 2 * step)[0]
    # Of what is a small change of the model both sides are simulated in the longer steps.
    loops = [_late_loop(plant, variation, part, rule) for part in ("kp", "kd")]
    late = residuals(plant, layout, windows, loops, 2 * step)
    gained = (windows.measured[:, 0] - first[:, 0])[:, layout.slices["joint_vel"]] - windows.qvel[:, plant.dof]
    start = _faster(plant, windows, rule.unit * gained / (2 * step))
    clock = double - residuals(plant, layout, windows, [variation], 2 * step, start)[0]
    clock[..., layout.slices["joint_vel"]] += (base - early)[..., layout.slices["joint_vel"]]
    coarser = _of_first_order(variation)
    other = double if coarser is None else residuals(plant, layout, windows, [coarser], step)[0]
    columns = [(base - other) * (rule.unit / step), double - late[0], double - late[1], clock]
    if plant.floating and "base_pos" not in layout.slices:
        higher = windows.qpos.copy()
        higher[:, plant.base_qpos + 2] += rule.height
        starts = Starts(higher[None], windows.qvel[None])
        columns.append(double - residuals(plant, layout, windows, [variation], 2 * step, starts)[0])
    return np.stack(columns)


def _of_first_order(variation: Variation) -> Variation | None:
    """The variation in steps whose error is of first order; None where its own steps are."""
    if int(variation.model.opt.integrator) != int(mujoco.mjtIntegrator.mjINT_RK4):
        return None
    model = copy.copy(variation.model)
    model.opt.integrator = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
    return replace(variation, model=model)


def _late_loop(plant: Plant, variation: Variation, part: str, rule: Nuisances) -> Variation:
    """Torque kp (u - q(t-e)) - kd qd(t-e), to first order in e: less damping by kp e, less inertia by kd e."""
    models = [_late_model(model, variation.plant or plant, part, rule) for model in variation.models]
    return replace(variation, model=models[0], others=tuple(models[1:]))


def _late_model(declared: mujoco.MjModel, own: Plant, part: str, rule: Nuisances) -> mujoco.MjModel:
    model = copy.copy(declared)
    for column, a in enumerate(own.actuator):
        if a >= 0:
            dof = own.dof[column]
            kp, kd = -model.actuator_biasprm[a, 1], -model.actuator_biasprm[a, 2]
            gear = model.actuator_gear[a, 0]
            if part == "kp":
                model.actuator_biasprm[a, 2] += kp * rule.unit
            else:
                lighter = model.dof_armature[dof] - kd * gear**2 * rule.unit
                model.dof_armature[dof] = max(_LEAST_ARMATURE * model.dof_armature[dof], lighter)
    return model


def _read_thrice(windows: Windows, after: float, before: float) -> Windows:
    """Windows (N ticks) compared at their ticks, `before` s before each, and `after` s from the start."""
    ticks = windows.out_time
    times = np.concatenate((ticks, ticks - before, np.full((len(windows), 1), after)), axis=1)

    def thrice(x: np.ndarray) -> np.ndarray:
        return np.concatenate((x, x, x[:, :1]), axis=1)

    quat = None if windows.quat is None else thrice(windows.quat)
    return replace(windows, out_time=times, measured=thrice(windows.measured), quat=quat)


def _faster(plant: Plant, windows: Windows, by: np.ndarray) -> Starts:
    """Starts whose joints are faster `by` (W, J) [rad/s]."""
    start = windows.qvel.copy()
    start[:, plant.dof] += by
    return Starts(windows.qpos[None], start[None])
