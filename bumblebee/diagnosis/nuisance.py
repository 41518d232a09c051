"""Directions in which two correct simulators differ: a fit must be free to move along them without naming an effect.

Truth comes from a robot, or from another integrator at another step. What such a difference does is of first order in
the step and the same for every joint, so each kind is one column with one coefficient for the whole dataset:

- integrator: this simulation at its step against itself at twice the step;
- position loop and velocity loop: the servo acts on readings that are a little old, q(t - e) and qd(t - e);
- velocity clock: velocities are read a little before positions;
- height, only where the base's height is not measured but taken from stance: all heights shifted, 1 for a millimetre.

A coefficient of 1 stands for one millisecond; that is also its prior's standard deviation.
"""

import copy
from dataclasses import replace

import numpy as np

from bumblebee.diagnosis.plant import Plant
from bumblebee.diagnosis.signals import Layout
from bumblebee.diagnosis.simulate import Starts, residuals
from bumblebee.diagnosis.variation import Variation
from bumblebee.diagnosis.windows import Windows, select

NAMES = ("integrator", "position_loop", "velocity_loop", "velocity_clock", "height")
_UNIT = 0.001  # [s]
_HEIGHT = 0.001  # [m]


def nuisance_columns(plant: Plant, layout: Layout, windows: Windows, variation: Variation, step: float) -> np.ndarray:
    """Change of the prediction for coefficient 1 of each nuisance, (4 or 5, W, N, D); diverged windows are NaN."""
    base = residuals(plant, layout, windows, [variation], step)[0]
    double = residuals(plant, layout, windows, [variation], 2 * step)[0]
    late = residuals(plant, layout, windows, [_late_loop(plant, variation, part) for part in ("kp", "kd")], step)
    clock = _clock(plant, layout, windows, variation, step, base)
    columns = [(base - double) * (_UNIT / step), base - late[0], base - late[1], clock]
    if plant.floating and "base_pos" not in layout.slices:
        higher = windows.qpos.copy()
        higher[:, plant.base_qpos + 2] += _HEIGHT
        starts = Starts(higher[None], windows.qvel[None])
        columns.append(base - residuals(plant, layout, windows, [variation], step, starts)[0])
    return np.stack(columns)


def _late_loop(plant: Plant, variation: Variation, part: str) -> Variation:
    """Torque kp (u - q(t-e)) - kd qd(t-e), to first order in e: less damping by kp e, less inertia by kd e."""
    model, own = copy.copy(variation.model), variation.plant or plant
    for column, a in enumerate(own.actuator):
        if a >= 0:
            dof = own.dof[column]
            kp, kd = -model.actuator_biasprm[a, 1], -model.actuator_biasprm[a, 2]
            gear = model.actuator_gear[a, 0]
            if part == "kp":
                model.actuator_biasprm[a, 2] += kp * _UNIT
            else:
                lighter = model.dof_armature[dof] - kd * gear**2 * _UNIT
                model.dof_armature[dof] = max(0.1 * model.dof_armature[dof], lighter)
    return replace(variation, model=model)


def _clock(
    plant: Plant, layout: Layout, windows: Windows, variation: Variation, step: float, base: np.ndarray
) -> np.ndarray:
    """Start faster by the acceleration times e and read the velocities e earlier."""
    early = _joint_velocities(plant, layout, windows, variation, step, -_UNIT)
    now = _joint_velocities(plant, layout, windows, variation, step, 0.0)
    first = _joint_velocities(plant, layout, windows, variation, step, 2 * step, at_start=True)
    start = windows.qvel.copy()
    acceleration = (first[:, 0] - start[:, plant.dof]) / (2 * step)
    start[:, plant.dof] += _UNIT * acceleration
    moved = residuals(plant, layout, windows, [variation], step, Starts(windows.qpos[None], start[None]))[0]
    out = base - moved
    out[..., layout.slices["joint_vel"]] += early - now
    return out


def _joint_velocities(
    plant: Plant,
    layout: Layout,
    windows: Windows,
    variation: Variation,
    step: float,
    shift: float,
    at_start: bool = False,
) -> np.ndarray:
    """Simulated joint velocities (W, N, J) at the compared ticks plus `shift` s, or `shift` s after the start."""
    times = np.full_like(windows.out_time, shift) if at_start else windows.out_time + shift
    moved = select(windows, np.arange(len(windows)))
    object.__setattr__(moved, "out_time", times)
    part = layout.slices["joint_vel"]
    return moved.measured[..., part] - residuals(plant, layout, moved, [variation], step)[0][..., part]
