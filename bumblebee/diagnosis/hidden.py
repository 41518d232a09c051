"""States that no sensor reads when a window starts: play, shafts, springs that yield."""

import numpy as np
from mujoco.batch import Batch

from bumblebee.diagnosis.memory import at_starts, logged_torques, yielded
from bumblebee.diagnosis.plant import Plant
from bumblebee.diagnosis.variation import Variation
from bumblebee.diagnosis.windows import Windows
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effect_native import SUFFIX


def restructured(
    plant: Plant, windows: Windows, lead: Variation, qpos: np.ndarray, qvel: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The starts in the layout of a model with play or shafts, whose own state follows from the torque through them.

    Args:
        plant: the declared model.
        windows: W windows.
        lead: a variation with a plant of its own.
        qpos: (..., W, nq) starts of the declared model.
        qvel: (..., W, nv).

    Returns:
        The same in the layout of `lead`, (..., W, nq'), (..., W, nv').
    """
    own = lead.plant
    assert own is not None
    q = np.broadcast_to(own.model.qpos0, (*qpos.shape[:-1], own.model.nq)).copy()
    v = np.zeros((*qvel.shape[:-1], own.model.nv))
    q[..., own.qpos], v[..., own.dof] = qpos[..., plant.qpos], qvel[..., plant.dof]
    if plant.floating:
        q[..., own.base_qpos : own.base_qpos + 7] = qpos[..., plant.base_qpos : plant.base_qpos + 7]
        v[..., own.base_dof : own.base_dof + 6] = qvel[..., plant.base_dof : plant.base_dof + 6]
    for kind, joint, values in lead.hidden:
        if kind in SUFFIX:
            column, second = plant.joints.index(joint), own.model.joint(joint + SUFFIX[kind])
            torque = transmitted(plant, windows, column)
            # The motor leads the link by half the gap, or by the shaft's twist, in the direction in which it pushes.
            ahead = 0.5 * values[0] * np.sign(torque) if kind == "backlash" else torque / values[0]
            q[..., int(second.qposadr[0])] = ahead if values[1] else -ahead
    return q, v


def transmitted(plant: Plant, windows: Windows, column: int) -> np.ndarray:
    """Torque (W,) [N m] that a joint's motor passes on at the windows' starts: the servo's less the rotor's share."""
    rotor = float(plant.model.dof_armature[plant.dof[column]])

    def of(rollout: Rollout) -> np.ndarray:
        growth = np.diff(rollout.joint_vel[:, column]) / np.diff(rollout.time)
        return logged_torques(plant, rollout)[0][:, column] - rotor * np.concatenate(([0.0], growth))

    return at_starts(windows, of)


def set_plastic(batch: Batch, plant: Plant, windows: Windows, lead: Variation, copies: int) -> None:
    """References of yielding springs, where the log before the start has left them."""
    if lead.plant is None or not any(kind == "hysteresis" for kind, _, _ in lead.hidden):
        return
    plastic = batch.bind("plastic")
    for kind, joint, values in lead.hidden:
        if kind == "hysteresis":
            column = plant.joints.index(joint)
            address = int(lead.model.jnt_plasticadr[lead.model.joint(joint).id])
            centre = yielded(windows, column, values[1]) - lead.offset[column]
            plastic[:, address] = np.tile(centre, copies)
