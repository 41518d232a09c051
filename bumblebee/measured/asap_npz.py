"""Importer of ASAP-style logs (.npz): what its DataLogger writes on the robot, one file a motion.

Keys: time, joint_pos, joint_vel, tau_est, IMU_quaternion (wxyz, Unitree's order), IMU_gyro, joint_pos_cmd, kp, kd and,
with motion capture, pos, quat (wxyz), lin_vel. The frame of lin_vel depends on the capture software; the data decide.
PACE's and Isaac Lab's names of the same arrays are taken, too. Without velocities these are differences of positions.
"""

from pathlib import Path

import mujoco
import numpy as np

from bumblebee.errors import BadInput
from bumblebee.measured.quaternion import conjugate, rotate
from bumblebee.measured.rollout import Rollout
from bumblebee.measured.source import (
    NO_VELOCITY,
    Source,
    differences,
    measured_rate,
    open_source,
    read_arrays,
    rollout_names,
)
from bumblebee.robot.facts import joint_names

NEEDED = ("time", "joint_pos", "joint_pos_cmd")
_JOINTS = ("joint_pos", "joint_vel", "joint_pos_cmd", "tau_est")
_OTHER_NAMES = {
    "joint_pos": ("dof_pos",),
    "joint_vel": ("dof_vel",),
    "joint_pos_cmd": ("des_dof_pos", "joint_pos_target", "joint_target", "dof_pos_target"),
    "tau_est": ("dof_torque", "joint_torque", "applied_torque"),
    "time": ("times", "timestamp"),
}


def import_asap(place: Path, model: mujoco.MjModel, joints: tuple[str, ...] = ()) -> list[Rollout]:
    """Every .npz of a folder or zip archive, or one file.

    Args:
        place: folder, archive or file.
        model: the declared model; joints that it lacks (wrists, say) are dropped.
        joints: joint names in the logs' order; by default the model's actuated joints, or the G1's 29.
    """
    source = open_source(place)
    names = source.ending(".npz")
    if not names:
        raise BadInput(place, ".npz files", "none")
    ids = rollout_names(names, ".npz")
    return [_read(source, name, ids[name], model, joints) for name in names]


def _read(source: Source, name: str, rollout_id: str, model: mujoco.MjModel, joints: tuple[str, ...]) -> Rollout:
    where, table = source.where(name), _renamed(read_arrays(source, name))
    for key in NEEDED:
        if key not in table:
            raise BadInput(f"{where}: {key}", "this array", f"only {', '.join(table)}")
    time = np.asarray(table["time"], dtype=np.float64).ravel()
    table |= {key: _flat(table[key]) for key in _JOINTS if key in table}
    differenced = "joint_vel" not in table
    if differenced:
        table["joint_vel"] = differences(time, table["joint_pos"])
    for key in _JOINTS:
        if key in table and (table[key].ndim != 2 or table[key].shape != table["joint_pos"].shape):
            raise BadInput(f"{where}: {key}", f"shape {table['joint_pos'].shape}", str(table[key].shape))
    if len(table["joint_pos"]) != len(time):
        raise BadInput(f"{where}: joint_pos", f"{len(time)} rows like time", str(len(table["joint_pos"])))
    named = joints or _default_joints(where, model, table["joint_pos"].shape[1])
    known = {model.joint(i).name for i in range(model.njnt)}
    keep = [i for i, joint in enumerate(named) if joint in known] or list(range(len(named)))
    meta = {"motion": rollout_id, "notes": "ASAP logger"}
    if differenced:
        meta["notes"] += f"; {NO_VELOCITY}"
    for key in ("kp", "kd"):
        if key in table:
            meta[key] = _gains(f"{where}: {key}", table[key], len(named))[keep].tolist()
    columns = {"joint_target": table["joint_pos_cmd"][:, keep]}
    if "tau_est" in table:
        columns["joint_torque"] = table["tau_est"][:, keep]
    base, notes = _base(table, time)
    meta["notes"] += notes
    return Rollout(
        rollout_id,
        tuple(named[i] for i in keep),
        measured_rate(time),
        time,
        table["joint_pos"][:, keep],
        table["joint_vel"][:, keep],
        **columns,
        **base,
        meta=meta,
    )


def _renamed(table: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The arrays under ASAP's names; what has them already stays."""
    for ours, others in _OTHER_NAMES.items():
        there = next((name for name in others if name in table), None)
        if ours not in table and there is not None:
            table = table | {ours: table[there]}
    return table


def _flat(values: np.ndarray) -> np.ndarray:
    """(T, J) of an array that a logger of one environment wrote as (T, 1, J)."""
    return values[:, 0] if values.ndim == 3 and values.shape[1] == 1 else values


def _gains(where: str, values: np.ndarray, joints: int) -> np.ndarray:
    """(J,) gains from one for all, one a joint, or one a joint in every row."""
    row = np.atleast_1d(values)
    row = row.reshape(-1, row.shape[-1])[0]
    if len(row) not in (1, joints):
        raise BadInput(where, f"one number or {joints}", str(len(row)))
    return np.broadcast_to(row, (joints,))


def _default_joints(where: str, model: mujoco.MjModel, width: int) -> tuple[str, ...]:
    actuated = tuple(model.joint(int(joint)).name for joint in model.actuator_trnid[:, 0])
    for names in (actuated, joint_names(29), joint_names(23)):
        if len(names) == width:
            return names
    raise BadInput(f"{where}: joint_pos", f"{len(actuated)} joints, as the model has", str(width), "Name the joints.")


def _base(table: dict[str, np.ndarray], time: np.ndarray) -> tuple[dict[str, np.ndarray], str]:
    """The base's columns, and what was decided about the frame of lin_vel."""
    names = {"IMU_quaternion": "base_quat", "IMU_gyro": "base_ang_vel", "pos": "base_pos", "lin_vel": "base_lin_vel"}
    base = {ours: np.asarray(table[theirs], dtype=np.float64) for theirs, ours in names.items() if theirs in table}
    quat = np.asarray(table.get("quat", base.get("base_quat", np.zeros((0, 4)))), dtype=np.float64)
    if "base_lin_vel" not in base or len(quat) != len(time):
        return base, ""
    norm = np.linalg.norm(quat, axis=1, keepdims=True)
    quat = quat / np.where(norm > 0, norm, 1)
    if "base_pos" not in base:
        return base, "; lin_vel taken as given in the base frame"
    rate = np.gradient(base["base_pos"], time, axis=0)
    in_world = np.nanmedian(np.linalg.norm(rate - base["base_lin_vel"], axis=1))
    in_base = np.nanmedian(np.linalg.norm(rate - rotate(quat, base["base_lin_vel"]), axis=1))
    if in_world >= in_base:
        return base, "; lin_vel agrees with the base frame"
    base["base_lin_vel"] = rotate(conjugate(quat), base["base_lin_vel"])
    return base, "; lin_vel was in the world frame and has been turned into the base frame"
