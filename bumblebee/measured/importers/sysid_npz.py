"""Importer of `mujoco.sysid` files (.npz): a SystemTrajectory, or TimeSeries whose names differ in their last word.

Signals are found by the JSON mapping name -> [type, columns] that mujoco.sysid writes (types: 0 sensor, 2 qpos, 3 qvel,
5 control). States come from qpos and qvel signals, or from jointpos and jointvel sensors of the model.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from bumblebee.errors import BadInput
from bumblebee.io.read import parse_json, require_real
from bumblebee.measured.checks import at_joint, servo_gains
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

SENSOR, QPOS, QVEL, CTRL = 0, 2, 3, 5
PART = re.compile(r"[_.-](control|controls|ctrl|sensordata|sensor|sensors|state|states|measured)$")
NOTES = "mujoco.sysid; controls held, states interpolated to the controls' times. Sensor data of mujoco.sysid may lag."


@dataclass(frozen=True)
class _Signal:
    """One named column with its time stamps."""

    time: np.ndarray
    values: np.ndarray


def import_sysid(place: Path, model: mujoco.MjModel) -> list[Rollout]:
    """Every .npz of a folder or zip archive, or one file, for the actuated hinges and slides of the model."""
    source = open_source(place)
    names = source.ending(".npz")
    if not names:
        raise BadInput(place, ".npz files", "none")
    groups: dict[str, list[str]] = {}
    for name, rollout_id in rollout_names(names, ".npz").items():
        groups.setdefault(PART.sub("", rollout_id) or rollout_id, []).append(name)
    return [_read(source, files, rollout_id, model) for rollout_id, files in groups.items()]


def _read(source: Source, files: list[str], rollout_id: str, model: mujoco.MjModel) -> Rollout:
    where, table = source.where(files[0]), {}
    signals: dict[tuple[str, str], _Signal] = {}
    for name in files:
        table = read_arrays(source, name)
        signals |= _signals(source.where(name), table, model)
    controls = {key[1]: signal for key, signal in signals.items() if key[0] == "ctrl"}
    if not controls:
        raise BadInput(where, "control signals with their mapping", f"only {', '.join(table)[:200] or 'nothing'}")
    joints, commands, actuators = [], [], []
    for actuator, signal in controls.items():
        number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuator)
        if number < 0 or not at_joint(model, number) or model.actuator_gear[number, 0] == 0:
            raise BadInput(f"{where}: {actuator}_ctrl", "an actuator of the model that turns a joint", actuator[:80])
        joints.append(model.joint(int(model.actuator_trnid[number, 0])).name)
        commands.append(signal)
        actuators.append(number)
    driven = len(joints)
    joints += [name for name in _turning(model) if ("pos", name) in signals and name not in joints]
    known = any(kind == "vel" for kind, _ in signals)
    kinds = {"pos": "joint_pos"} | ({"vel": "joint_vel"} if known else {})
    time = _shared(
        where, [commands[0], *(s for (kind, joint), s in signals.items() if kind in kinds and joint in joints)]
    )
    state = {}
    for kind, column in kinds.items():
        missing = [joint for joint in joints if (kind, joint) not in signals]
        if missing:
            raise BadInput(
                f"{where}: {column}", f"a signal for joint {missing[0]}", f"only {', '.join(_said(signals))}"[:200]
            )
        state[column] = np.stack([_at(signals[kind, joint], time) for joint in joints], axis=1)
    state.setdefault("joint_vel", differences(time, state["joint_pos"]))
    given = np.stack([_held(one, time) for one in commands], axis=1)
    gains = servo_gains(model)
    column = "joint_target" if all(joint in gains for joint in joints[:driven]) else "joint_torque_cmd"
    given = _at_the_joints(given, model, actuators, column == "joint_target")
    # What has no drive got no torque, and a target that nothing follows is where it was.
    rest = state["joint_pos"][:, driven:]
    given = np.concatenate((given, rest if column == "joint_target" else np.zeros_like(rest)), axis=1)
    meta = {"motion": rollout_id, "notes": NOTES if known else f"{NOTES} {NO_VELOCITY}."}
    return Rollout(rollout_id, tuple(joints), measured_rate(time), time, **state, **{column: given}, meta=meta)


def _at_the_joints(given: np.ndarray, model: mujoco.MjModel, actuators: list[int], targets: bool) -> np.ndarray:
    """Controls (T, A) within their ranges, as targets [rad] or torques [N m] at the joints."""
    low, high = model.actuator_ctrlrange[actuators].T
    limited = model.actuator_ctrllimited[actuators].astype(bool)
    given = np.where(limited, np.clip(given, low, high), given)
    gear = model.actuator_gear[actuators, 0]
    if targets:
        return given / gear
    motor = model.actuator_gaintype[actuators] == int(mujoco.mjtGain.mjGAIN_FIXED)
    return given * np.where(motor, gear * model.actuator_gainprm[actuators, 0], 1.0)


def _turning(model: mujoco.MjModel) -> list[str]:
    """Names of the hinges and slides."""
    kinds = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    return [model.joint(i).name for i in range(model.njnt) if int(model.jnt_type[i]) in kinds]


def _signals(where: str, table: dict[str, np.ndarray], model: mujoco.MjModel) -> dict[tuple[str, str], _Signal]:
    """("ctrl", actuator), ("pos", joint) and ("vel", joint) -> signal, from all series of the file."""
    found: dict[tuple[str, str], _Signal] = {}
    for prefix in ("", "control_", "sensordata_", "state_"):  # states replace sensors of the same joint
        if f"{prefix}times" not in table or f"{prefix}data" not in table:
            continue
        time, data = (_finite(f"{where}: {prefix}{key}", table[f"{prefix}{key}"]) for key in ("times", "data"))
        data = data[:, None] if data.ndim == 1 else data
        mapping = _mapping(where, table, prefix, model)
        if (np.diff(time.ravel()) <= 0).any():
            row = int(np.argmax(np.diff(time.ravel()) <= 0)) + 1
            raise BadInput(f"{where}: {prefix}times, row {row}", "increasing times", "a step back or a repeat")
        if time.ndim != 1 or data.ndim != 2 or len(time) != len(data):
            raise BadInput(f"{where}: {prefix}data", f"{time.size} rows like {prefix}times", str(data.shape))
        for name, (kind, columns) in mapping.items():
            place = _place(name, kind, model)
            if place is None or not columns:
                continue
            if not 0 <= min(columns) <= max(columns) < data.shape[1]:
                raise BadInput(f"{where}: {name}", f"columns from 0 to {data.shape[1] - 1}", str(columns)[:80])
            found[place] = _Signal(time, data[:, columns[0]])
    return found


def _mapping(
    where: str, table: dict[str, np.ndarray], prefix: str, model: mujoco.MjModel
) -> dict[str, tuple[int, list[int]]]:
    if f"{prefix}signal_mapping" not in table:
        if prefix == "control_":  # without a mapping the columns are the model's controls
            return {f"{model.actuator(i).name}_ctrl": (CTRL, [i]) for i in range(model.nu)}
        return {}
    place = f"{where}: {prefix}signal_mapping"
    try:
        raw = parse_json(place, str(table[f"{prefix}signal_mapping"]))
        return {_name(name): (int(kind), [int(column) for column in columns]) for name, (kind, columns) in raw.items()}
    except (ValueError, TypeError, AttributeError, OverflowError) as error:
        raise BadInput(place, "JSON: name -> [type, columns]", str(error)[:160]) from None


def _finite(where: str, values: np.ndarray) -> np.ndarray:
    return require_finite(where, require_real(where, values))


def _name(text: str) -> str:
    """A name that MuJoCo can be asked for: it ends names at a NUL and knows no halves of surrogate pairs."""
    if "\0" in text:
        raise ValueError("a name with NUL in it")
    return text.encode().decode()


def _place(name: str, kind: int, model: mujoco.MjModel) -> tuple[str, str] | None:
    if kind == CTRL:
        return "ctrl", name.removesuffix("_ctrl")
    if kind == QPOS:
        return "pos", name.removesuffix("_qpos")
    if kind == QVEL:
        return "vel", name.removesuffix("_qvel")
    sensor = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, name) if kind == SENSOR else -1
    kinds = {mujoco.mjtSensor.mjSENS_JOINTPOS: "pos", mujoco.mjtSensor.mjSENS_JOINTVEL: "vel"}
    what = kinds.get(mujoco.mjtSensor(int(model.sensor_type[sensor]))) if sensor >= 0 else None
    return (what, model.joint(int(model.sensor_objid[sensor])).name) if what else None


def _shared(where: str, signals: list[_Signal]) -> np.ndarray:
    """Stamps of the first signal, the controls', while all are logged."""
    time = signals[0].time
    if any(len(one.time) < 2 for one in signals):
        raise BadInput(where, "at least 2 rows of controls and states", "fewer")
    time = time[(time >= max(one.time[0] for one in signals)) & (time <= min(one.time[-1] for one in signals))]
    if len(time) < 2:
        raise BadInput(where, "controls and states of the same time", "none that overlap")
    return time


def _held(signal: _Signal, time: np.ndarray) -> np.ndarray:
    """A control at the stamps `time`: the latest that was given."""
    return signal.values[np.clip(np.searchsorted(signal.time, time, side="right") - 1, 0, None)]


def _at(signal: _Signal, time: np.ndarray) -> np.ndarray:
    return signal.values if np.array_equal(signal.time, time) else np.interp(time, signal.time, signal.values)


def _said(signals: dict[tuple[str, str], _Signal]) -> list[str]:
    return sorted(f"{kind} {name}" for kind, name in signals)
