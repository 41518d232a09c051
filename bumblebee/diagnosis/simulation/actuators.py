"""Drives of a joint: the force law of any MuJoCo actuator by probing it, and drives made to take what was logged.

`motor`, `position`, `general`, `pid` and `dcmotor` keep their gains in different places. A force for a small change of
input, position and velocity is the same question for all of them.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from bumblebee.diagnosis.thresholds.simulation import DriveProbe
from bumblebee.errors import BadInput

_FEEDBACK = 1e-9
"""Stiffness [N m/rad, N/m] above which an actuator feeds a position back, and takes a position target."""

_AFFINE = (int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtGain.mjGAIN_AFFINE))


@dataclass(frozen=True, eq=False)
class DriveLaw:
    """First derivatives of the actuators' forces at rest in the reference pose; nu actuators of one input each."""

    gain: np.ndarray
    """(nu,) force for a unit of input, the input held long enough for filters to settle."""
    stiffness: np.ndarray
    """(nu,) force against a unit of the actuator's length; 0 where no position is fed back."""
    simple: np.ndarray
    """(nu,) bool: force = gain * input + affine bias, so that gains can be scaled in gainprm and biasprm."""

    servo: np.ndarray
    """(nu,) bool: whether the actuator takes a position target."""


def drive_law(model: mujoco.MjModel, where: object, rule: DriveProbe) -> DriveLaw:
    """Probe every actuator of `model`, its ranges aside; `where` names it in errors for actuators of several inputs."""
    count = len(model.actuator_trntype)
    if model.nu != count:
        raise BadInput(where, "actuators of one input each", f"{count} actuators with {model.nu} inputs")
    model = copy.copy(model)
    model.actuator_ctrllimited[:], model.actuator_forcelimited[:] = 0, 0
    data = mujoco.MjData(model)
    gain, stiffness = np.zeros(count), np.zeros(count)
    fed = [int(model.actuator_actadr[a]) for a in range(count)]
    base = _force(model, data, fed, np.zeros(count))
    for a in range(count):
        control = np.zeros(count)
        control[a] = rule.step
        gain[a] = (_force(model, data, fed, control)[a] - base[a]) / rule.step
        joint = int(model.actuator_trnid[a, 0])
        if int(model.actuator_trntype[a]) == int(mujoco.mjtTrn.mjTRN_JOINT) and model.jnt_type[joint] > 1:
            mujoco.mj_resetData(model, data)
            data.qpos[model.jnt_qposadr[joint]] += rule.step
            gear = model.actuator_gear[a, 0]
            stiffness[a] = -(_force(model, data, fed, np.zeros(count), reset=False)[a] - base[a]) / (rule.step * gear)
    simple = np.isin(model.actuator_gaintype, _AFFINE) & (model.actuator_gainprm[:, 1:3] == 0).all(axis=1)
    return DriveLaw(gain, stiffness, simple, np.abs(stiffness) > _FEEDBACK)


def _force(
    model: mujoco.MjModel, data: mujoco.MjData, fed: Sequence[int], control: np.ndarray, reset: bool = True
) -> np.ndarray:
    """Forces (nu,) for a held control; a filter's activation has settled at its input."""
    if reset:
        mujoco.mj_resetData(model, data)
    data.ctrl[:] = control
    filters = (int(mujoco.mjtDyn.mjDYN_FILTER), int(mujoco.mjtDyn.mjDYN_FILTEREXACT))
    for a, address in enumerate(fed):
        if address >= 0 and int(model.actuator_dyntype[a]) in filters:
            data.act[address] = control[a]
    mujoco.mj_forward(model, data)
    return data.actuator_force.copy()


def take_torque(actuator: mujoco.MjsActuator) -> None:
    """Turn a servo or a dcmotor into a motor that takes the logged torque; its force limit stays.

    A drive that is commanded in torque closes a current loop: its back-EMF and its position gains are not felt.
    """
    actuator.set_to_motor()
    _without_ranges(actuator)


def take_target(actuator: mujoco.MjsActuator, kp: float, kd: float) -> None:
    """Turn a motor into a servo of kp [N m/rad], kd [N m s/rad] at the joint; its force limit stays."""
    gear = actuator.gear[0]
    actuator.set_to_position(kp=kp / gear**2, kv=kd / gear**2)
    _without_ranges(actuator)


def _without_ranges(actuator: mujoco.MjsActuator) -> None:
    """Take what was logged as it is: ranges of the input, and of an activation that is gone, are of the old drive."""
    actuator.ctrllimited = actuator.actlimited = int(mujoco.mjtLimited.mjLIMITED_FALSE)
    actuator.actrange = [0.0, 0.0]
