"""States that no sensor reads when a window starts: play, shafts, springs that yield.

Shafts are led in: the simulation begins 0.1 s before the window, at rest under the torque there, and what its hidden
hinges have come to is where the window starts. A shaft of a light joint swings for longer than a control period, and a
torque that has just jumped says nothing of its twist. Play is not: on which side it touches follows from the torque.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from mujoco.batch import Batch

from bumblebee.diagnosis.simulation.plant import Plant
from bumblebee.diagnosis.simulation.starts.actuator_history import at_starts, logged_torques, yielded
from bumblebee.diagnosis.simulation.variation import Variation
from bumblebee.diagnosis.simulation.windows import Windows, start_state
from bumblebee.diagnosis.thresholds.simulation import HiddenStates
from bumblebee.measured.rollout import Rollout
from bumblebee.sim.effects import SUFFIX

_LEAD_ERROR = 0.1
"""Share of the lead by which that of a window may differ; beyond it the log has a gap there."""

Known = tuple[np.ndarray, np.ndarray, np.ndarray]
"""States (W, nq'), (W, nv') of a model with play or shafts, and for which windows (W,) they are to be believed."""


def step_share(hidden: Sequence[tuple[str, str, tuple[float, ...]]], rule: HiddenStates) -> float:
    """Share of the step that a model with these structural effects (kind, joint, parameters) needs."""
    finer = any(kind == "backlash" or (kind in SUFFIX and values[1]) for kind, _, values in hidden)
    return rule.step_share if finer else 1.0


def earlier(plant: Plant, windows: Windows) -> tuple[Windows, float, np.ndarray]:
    """The windows begun by the lead before their starts; how much [s]; where (W,) the log has it without a gap."""
    lead = plant.thresholds.windows.lead
    first, ahead = np.empty(len(windows), dtype=int), np.empty(len(windows))
    qpos, qvel = windows.qpos.copy(), windows.qvel.copy()
    for w, (i, k) in enumerate(zip(windows.rollout, windows.start, strict=True)):
        rollout = windows.source[i]
        first[w] = int(np.searchsorted(rollout.time, rollout.time[k] - lead - 1e-6))
        ahead[w] = rollout.time[k] - rollout.time[first[w]]
        height = windows.qpos[w, plant.base_qpos + 2] if plant.floating and rollout.base_pos is None else None
        qpos[w], qvel[w] = start_state(plant, rollout, int(first[w]), height)
    span = float(np.median(ahead))
    time = windows.command_time + ahead[:, None]
    early = replace(windows, start=first, qpos=qpos, qvel=qvel, command_time=time)
    return early, span, np.abs(ahead - span) < _LEAD_ERROR * lead


def restructured(
    plant: Plant, windows: Windows, lead: Variation, qpos: np.ndarray, qvel: np.ndarray, known: Known | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """The starts in the layout of a model with play or shafts.

    Their own state is the known one; where there is none, it follows from the torque through them.

    Args:
        plant: the declared model.
        windows: W windows.
        lead: a variation with a plant of its own.
        qpos: (..., W, nq) starts of the declared model.
        qvel: (..., W, nv).
        known: what a simulation that began earlier has come to.

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
            at, dof = int(second.qposadr[0]), int(second.dofadr[0])
            q[..., at] = ahead if values[1] else -ahead
            if known is not None:
                q[..., at] = np.where(known[2], known[0][:, at], q[..., at])
                v[..., dof] = np.where(known[2], known[1][:, dof], 0.0)
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
            centre = yielded(windows, column, values[1], plant.thresholds.path) - lead.offset[column]
            plastic[:, address] = np.tile(centre, copies)
