"""Typical sizes of a dataset's signals, from which the first steps of candidates follow."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee.diagnosis.simulation import Plant, command_inputs, plant_servos
from bumblebee.diagnosis.thresholds.candidates import SignalScales
from bumblebee.measured.rollout import Rollout


@dataclass(frozen=True, eq=False)
class Scales:
    """Typical sizes of the data, from which first steps follow; J joints."""

    torque: np.ndarray
    """(J,) RMS servo torque [N m], of a joint without a drive that of gravity and speeds."""
    peak: np.ndarray
    """(J,) largest servo torque [N m]."""
    speed: np.ndarray
    """(J,) RMS speed [rad/s]."""
    fastest: np.ndarray
    """(J,) largest speed [rad/s]."""
    travel: np.ndarray
    """(J,) range of positions [rad]."""
    inertia: np.ndarray
    """(J,) diagonal of the joint-space inertia [kg m^2], its mean over the poses logged."""
    target_rate: np.ndarray
    """(J,) largest change of the targets a second [rad/s]; 0 where torques are logged."""
    target_turn: np.ndarray
    """(J,) largest change of that a second [rad/s^2]."""
    duration: float
    """Longest rollout [s]."""


def scales_of(
    plant: Plant,
    rollouts: Sequence[Rollout],
    rule: SignalScales | None = None,
    models: Sequence[mujoco.MjModel] = (),
) -> Scales:
    """Typical sizes by `models`, one for each condition, or by the declared ones; floored for joints that rest."""
    rule, torques = rule or SignalScales(), []
    every = [plant_servos(plant, model) for model in models or [p.model for p in plant.every]]
    for r in rollouts:
        servos = every[plant.under.get(r.rollout_id, 0)]
        control = servos.controls(command_inputs(plant, r))
        torques.append(servos.torque(r.joint_pos - plant.offset, r.joint_vel, control))
    rms = np.sqrt(np.mean([(t**2).mean(axis=0) for t in torques], axis=0))
    if (plant.actuator < 0).any():
        rms = np.where(plant.actuator < 0, np.maximum(rms, _bias(plant, rollouts, rule.rows)), rms)
    torque = np.maximum(rms, rule.torque * rms.max() + 1e-9)
    speeds = np.sqrt(np.mean([(r.joint_vel**2).mean(axis=0) for r in rollouts], axis=0))
    return Scales(
        torque=torque,
        peak=np.max([np.quantile(np.abs(t), rule.peak, axis=0) for t in torques], axis=0),
        speed=np.maximum(speeds, rule.speed * speeds.max() + 1e-6),
        fastest=np.max([np.quantile(np.abs(r.joint_vel), rule.peak, axis=0) for r in rollouts], axis=0) + 1e-3,
        travel=np.max([np.ptp(r.joint_pos, axis=0) for r in rollouts], axis=0),
        inertia=_inertia(plant, rollouts, rule.rows),
        target_rate=_steepest(plant, rollouts, 1, rule),
        target_turn=_steepest(plant, rollouts, 2, rule),
        duration=float(max(r.time[-1] - r.time[0] for r in rollouts)),
    )


def _steepest(plant: Plant, rollouts: Sequence[Rollout], order: int, rule: SignalScales) -> np.ndarray:
    """Largest derivative (J,) of the targets of some order, by differences between commands."""
    found = [np.zeros(len(plant.joints))]
    for r in rollouts if not plant.torque_input else ():
        values, dt = r.joint_target, float(np.median(np.diff(r.time)))
        if values is not None and r.frames > order:
            found.append(np.quantile(np.abs(np.diff(values, order, axis=0)), rule.peak, axis=0) / dt**order)
    return np.max(found, axis=0)


def _bias(plant: Plant, rollouts: Sequence[Rollout], rows: int) -> np.ndarray:
    """RMS torque (J,) [N m] of gravity and of speeds along the rollouts: what a joint without a drive moves under."""
    data, found = mujoco.MjData(plant.model), []
    for r in rollouts:
        for k in np.linspace(0, r.frames - 1, rows).astype(int):
            data.qpos[plant.qpos], data.qvel[plant.dof] = r.joint_pos[k], r.joint_vel[k]
            mujoco.mj_forward(plant.model, data)
            found.append(data.qfrc_bias[plant.dof])
    return np.sqrt(np.mean(np.square(found), axis=0))


def _inertia(plant: Plant, rollouts: Sequence[Rollout], rows: int) -> np.ndarray:
    """Diagonal of the joint-space inertia (J,), its mean over poses of the rollouts.

    In the reference pose of an arm that stands upright its first joint has next to none.
    """
    data, found, full = mujoco.MjData(plant.model), [], np.zeros((plant.model.nv, plant.model.nv))
    for r in rollouts:
        for k in np.linspace(0, r.frames - 1, rows).astype(int):
            data.qpos[plant.qpos] = r.joint_pos[k] - plant.offset
            mujoco.mj_kinematics(plant.model, data)
            mujoco.mj_comPos(plant.model, data)
            mujoco.mj_makeM(plant.model, data)
            mujoco.mj_fullM(plant.model, data, full)
            found.append(np.diag(full)[plant.dof].copy())
    return np.mean(found, axis=0)
