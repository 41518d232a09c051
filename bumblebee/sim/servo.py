"""The position servos of a model as arrays over its joints: the torque that they give, computed beside MuJoCo."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from bumblebee.robot.drives import ON_JOINT, force_limit


@dataclass(frozen=True, eq=False)
class Servos:
    """J joints; a joint without an actuator has zeros and the actuator -1.

    Of worlds that differ in gains, bias and limit these have leading axes, which broadcast against the states'.
    """

    actuator: np.ndarray
    """(J,) index, -1 for none."""
    qpos: np.ndarray
    """(J,) addresses in qpos."""
    dof: np.ndarray
    """(J,) addresses in qvel."""
    gear: np.ndarray
    gain: np.ndarray
    """(..., J) torque for a unit of control [N m]."""
    bias: np.ndarray
    """(..., J, 3) torque: constant, for a unit of position, for a unit of velocity."""
    limit: np.ndarray
    """(..., J) largest torque both ways [N m]; infinite for none."""
    supply: np.ndarray | float = 1.0
    """(..., 1) supply voltage as a share of that at which a speed leaves no torque."""

    def torque(
        self, position: np.ndarray, velocity: np.ndarray, control: np.ndarray, limit: np.ndarray | float | None = None
    ) -> np.ndarray:
        """Torque (..., J) [N m] at positions, velocities and controls (..., J) of the servos."""
        bias = self.bias
        raw = self.gain * control + bias[..., 0] + bias[..., 1] * position + bias[..., 2] * velocity
        bound = self.limit if limit is None else limit
        return np.minimum(np.maximum(raw, -bound), bound)  # of few numbers `np.clip` takes twice as long

    def given(self, control: np.ndarray) -> np.ndarray:
        """Request (..., J) from the servos' controls: a position [rad], or a torque [N m] of a motor."""
        follows = self.bias[..., 1] != 0
        return np.where(follows, control / np.where(self.gear != 0, self.gear, 1.0), self.gain * control)

    def controls(self, ctrl: np.ndarray) -> np.ndarray:
        """Columns (..., J) of the actuators' controls (..., nu)."""
        return (
            ctrl[..., np.maximum(self.actuator, 0)] if ctrl.shape[-1] else np.zeros((*ctrl.shape[:-1], len(self.dof)))
        )


def servos_of(model: mujoco.MjModel, joints: list[int]) -> Servos:
    """The servos of the joints with these ids."""
    actuator = np.array([actuator_of(model, j) for j in joints], dtype=int)
    has, a = actuator >= 0, np.maximum(actuator, 0)
    if not model.nu:
        zeros = np.zeros(len(joints))
        gear, gain, bias, limit = zeros, zeros, np.zeros((len(joints), 3)), np.full(len(joints), np.inf)
    else:
        gear = model.actuator_gear[a, 0] * has
        gain = gear * model.actuator_gainprm[a, 0]
        bias = gear[:, None] * model.actuator_biasprm[a, :3]
        bias[:, 1:] *= gear[:, None]
        limited = has & (model.actuator_forcelimited[a] != 0)
        limit = np.where(limited, np.abs(gear) * np.array([force_limit(model, k) for k in a]), np.inf)
    return Servos(
        actuator=actuator,
        qpos=model.jnt_qposadr[joints].astype(int),
        dof=model.jnt_dofadr[joints].astype(int),
        gear=gear,
        gain=gain,
        bias=bias,
        limit=limit,
    )


def servos_each(servos: Sequence[Servos], which: np.ndarray) -> Servos:
    """One of several models' servos for each world: `which` (...) is its index; of one model they stay as they are."""
    first = servos[0]
    if len(servos) == 1:
        return first
    rows = {name: np.stack([getattr(s, name) for s in servos])[which] for name in ("gain", "bias", "limit")}
    return replace(first, **rows)


def actuator_of(model: mujoco.MjModel, joint: int) -> int:
    """The actuator that drives a joint: the first that follows a position, else the first on it, -1 if none."""
    there = [
        a for a in range(model.nu) if model.actuator_trntype[a] in ON_JOINT and model.actuator_trnid[a, 0] == joint
    ]
    return next((a for a in there if model.actuator_biasprm[a, 1] != 0), there[0] if there else -1)
