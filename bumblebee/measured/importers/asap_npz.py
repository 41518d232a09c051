"""Importer of ASAP-style logs (.npz): what its DataLogger writes on the robot, one file a motion.

Keys: time, joint_pos, joint_vel, tau_est, IMU_quaternion (wxyz, Unitree's order), IMU_gyro, joint_pos_cmd, kp, kd and,
with motion capture, pos, quat (wxyz), lin_vel. The frame of lin_vel depends on the capture software; the data decide.
PACE's and Isaac Lab's names of the same arrays are taken, too. Without velocities these are differences of positions.
"""

from pathlib import Path

import mujoco
import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import require_real
from bumblebee.measured.checks import Thresholds, View, check_base, driven_joints
from bumblebee.measured.importers.source import (
    NO_VELOCITY,
    Source,
    differences,
    measured_rate,
    open_source,
    read_arrays,
    rollout_names,
)
from bumblebee.measured.rollout import Rollout
from bumblebee.measured.tables import require_finite
from bumblebee.quaternions import conjugate, rotate_by_cross
from bumblebee.robot.facts import joint_names

NEEDED = ("time", "joint_pos", "joint_pos_cmd")
_JOINTS = ("joint_pos", "joint_vel", "joint_pos_cmd", "tau_est")
_BASE = {"IMU_quaternion": 4, "IMU_gyro": 3, "pos": 3, "quat": 4, "lin_vel": 3}
_KNOWN = {"time", "kp", "kd", *_JOINTS, *_BASE}
_OTHER_NAMES = {
    "joint_pos": ("dof_pos",),
    "joint_vel": ("dof_vel",),
    "joint_pos_cmd": ("des_dof_pos", "joint_pos_target", "joint_target", "dof_pos_target"),
    "tau_est": ("dof_torque", "joint_torque", "applied_torque"),
    "time": ("times", "timestamp"),
}


def import_asap(place: Path, model: mujoco.MjModel) -> list[Rollout]:
    """Every .npz of a folder or zip archive, or one file.

    Args:
        place: folder, archive or file.
        model: the declared model, whose actuated joints the logs hold in its order; or the G1's 29, of which those that
            it lacks (wrists, say) are dropped.
    """
    source = open_source(place)
    names = source.ending(".npz")
    if not names:
        raise BadInput(place, ".npz files", "none")
    ids = rollout_names(names, ".npz")
    return [_read(source, name, ids[name], model) for name in names]


def _read(source: Source, name: str, rollout_id: str, model: mujoco.MjModel) -> Rollout:
    where, table = source.where(name), _renamed(read_arrays(source, name))
    for key in NEEDED:
        if key not in table:
            raise BadInput(f"{where}: {key}", "this array", f"only {', '.join(table)[:200] or 'nothing'}")
    table = {key: _measured(f"{where}: {key}", values) for key, values in table.items() if key in _KNOWN}
    time = table["time"].ravel()
    if not len(time):
        raise BadInput(f"{where}: time", "time stamps", "none")
    table |= {key: _flat(table[key]) for key in _JOINTS if key in table}
    _require_shapes(where, table, len(time))
    differenced = "joint_vel" not in table
    if differenced:
        table["joint_vel"] = differences(time, table["joint_pos"])
    named = _default_joints(where, model, table["joint_pos"].shape[1])
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
    rollout = Rollout(
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
    _require_wxyz(where, rollout, model)
    return rollout


def _measured(where: str, values: np.ndarray) -> np.ndarray:
    """Real, finite numbers: the logger writes nothing else, and half a reading is no log."""
    return require_finite(where, require_real(where, values))


def _require_shapes(where: str, table: dict[str, np.ndarray], rows: int) -> None:
    """Every array with a row for every time stamp, and as many joints or components as it must have."""
    wanted: dict[str, tuple[object, ...]] = {key: (rows, size) for key, size in _BASE.items()}
    place = table["joint_pos"]
    width = place.shape[1] if place.ndim == 2 else 0
    wanted |= dict.fromkeys(_JOINTS, (rows, width or "joints"))
    for key, shape in wanted.items():
        if key in table and table[key].shape != shape:
            raise BadInput(f"{where}: {key}", f"shape {shape}, a row for every time stamp", str(table[key].shape))


def _require_wxyz(where: str, rollout: Rollout, model: mujoco.MjModel) -> None:
    """Refuse quaternions that only fit the gyro as xyzw; what the data leave open is noted."""
    if rollout.base_quat is None or rollout.base_ang_vel is None or rollout.frames < 4:
        return
    if not (np.diff(rollout.time) > 0).all():
        return  # without a clock nothing can be said; the intake will say so
    view = View(where, rollout, model, None, Thresholds())
    with np.errstate(all="ignore"):
        check_base(view)
    for finding in view.findings:
        if finding.rule == "quaternion-order" and finding.fatal:
            raise BadInput(
                f"{where}: IMU_quaternion",
                "wxyz, Unitree's order",
                finding.came,
                "Store np.roll(IMU_quaternion, 1, axis=1).",
            )
        rollout.meta["notes"] += f"; {finding.rule}: {finding.came}"


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
    row = row.reshape(-1, row.shape[-1])[0] if row.size else row.ravel()
    if len(row) not in (1, joints):
        raise BadInput(where, f"one number or {joints}", str(len(row)))
    return np.broadcast_to(row, (joints,))


def _default_joints(where: str, model: mujoco.MjModel, width: int) -> tuple[str, ...]:
    actuated = driven_joints(model)
    for names in (actuated, joint_names(every=True), joint_names()):
        if len(names) == width:
            return names
    raise BadInput(
        f"{where}: joint_pos",
        f"{len(actuated)} joints, as the model has",
        str(width),
        "Give the model of the robot that was logged: --model.",
    )


def _base(table: dict[str, np.ndarray], time: np.ndarray) -> tuple[dict[str, np.ndarray], str]:
    """The base's columns, and what was decided about the frame of lin_vel."""
    names = {"IMU_quaternion": "base_quat", "IMU_gyro": "base_ang_vel", "pos": "base_pos", "lin_vel": "base_lin_vel"}
    base = {ours: table[theirs] for theirs, ours in names.items() if theirs in table}
    quat = table.get("quat", base.get("base_quat", np.zeros((0, 4))))
    if "base_lin_vel" not in base or len(quat) != len(time):
        return base, ""
    norm = np.linalg.norm(quat, axis=1, keepdims=True)
    quat = quat / np.where(norm > 0, norm, 1)
    if "base_pos" not in base:
        return base, "; lin_vel taken as given in the base frame"
    rate = differences(time, base["base_pos"])
    if not np.isfinite(rate).all():
        return base, "; lin_vel taken as given in the base frame, as the time stamps do not increase"
    in_world = np.nanmedian(np.linalg.norm(rate - base["base_lin_vel"], axis=1))
    in_base = np.nanmedian(np.linalg.norm(rate - rotate_by_cross(quat, base["base_lin_vel"]), axis=1))
    if in_world >= in_base:
        return base, "; lin_vel agrees with the base frame"
    base["base_lin_vel"] = rotate_by_cross(conjugate(quat), base["base_lin_vel"])
    return base, "; lin_vel was in the world frame and has been turned into the base frame"
