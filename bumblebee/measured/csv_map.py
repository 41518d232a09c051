"""Importer of CSV logs by a map from the contract's columns to the file's own names."""

import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
import yaml

from bumblebee.errors import BadInput
from bumblebee.measured.rollout import WIDTHS, Rollout
from bumblebee.measured.source import Source, measured_rate, open_source, rollout_names

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
ANGULAR = ("joint_pos", "joint_vel", "joint_target", "base_ang_vel")


@dataclass(frozen=True)
class ColumnMap:
    """Which columns of a CSV hold what; a file takes the first map of a list whose columns it has."""

    joints: tuple[str, ...]
    """Joints of the model, in the order in which the columns are named below."""
    columns: dict[str, tuple[str, ...]]
    """Column of the contract -> names in the file, one a joint or component."""
    time: str = "time"
    """Name of the column of time stamps."""
    time_unit: Literal["s", "ms", "us", "ns"] = "s"
    """Unit of the time stamps."""
    angle_unit: Literal["rad", "deg"] = "rad"
    """Unit of joint positions, velocities, targets and of the gyro."""
    quat_order: Literal["wxyz", "xyzw"] = "wxyz"
    """Order of base_quat as the file's columns are named in the map."""
    meta: dict[str, Any] = field(default_factory=dict)
    """robot, kp, kd, notes and other metadata of the contract."""


def _pair(stem: str) -> tuple[str, ...]:
    return (f"{stem}1", f"{stem}2")


_PENDULUM = {"robot": "double_pendulum_A0"}
# The two layouts of dfki-ric-underactuated-lab/double_pendulum; the longer one first.
DOUBLE_PENDULUM = tuple(
    ColumnMap(("joint1", "joint2"), {column: _pair(stem) for column, stem in stems.items()}, meta=_PENDULUM)
    for stems in (
        {"joint_pos": "pos_meas", "joint_vel": "vel_meas", "joint_torque_cmd": "tau_con", "joint_torque": "tau_meas"},
        {"joint_pos": "pos", "joint_vel": "vel", "joint_torque_cmd": "tau"},
    )
)


def import_csv(place: Path, maps: Sequence[ColumnMap]) -> list[Rollout]:
    """Every CSV of a folder or zip archive, or one file."""
    source = open_source(place)
    names = source.ending(".csv")
    if not names:
        raise BadInput(place, "CSV files", "none")
    ids = rollout_names(names, ".csv")
    return [_read(source, name, ids[name], maps) for name in names]


def read_map(path: Path) -> ColumnMap:
    """A column map from a YAML file with the keys of `ColumnMap`."""
    try:
        table = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except (OSError, yaml.YAMLError, UnicodeDecodeError) as error:
        raise BadInput(path, "a YAML file with a column map", str(error)) from None
    known = set(ColumnMap.__dataclass_fields__)
    if not isinstance(table, dict) or not {"joints", "columns"} <= set(table) or set(table) - known:
        came = ", ".join(map(str, table)) if isinstance(table, dict) else type(table).__name__
        raise BadInput(path, f"joints, columns and no keys but {', '.join(sorted(known))}", came)
    wrong = sorted(set(table["columns"]) - set(WIDTHS)) if isinstance(table["columns"], dict) else ["columns"]
    if wrong:
        raise BadInput(f"{path}: columns", f"columns of the contract ({', '.join(WIDTHS)})", wrong[0])
    units = {"time_unit": tuple(SECONDS), "angle_unit": ("rad", "deg"), "quat_order": ("wxyz", "xyzw")}
    for key, allowed in units.items():
        if table.get(key, allowed[0]) not in allowed:
            raise BadInput(f"{path}: {key}", f"one of {', '.join(allowed)}", repr(table[key]))
    columns = {name: tuple(map(str, files)) for name, files in table["columns"].items()}
    return ColumnMap(**(table | {"joints": tuple(table["joints"]), "columns": columns}))


def _read(source: Source, name: str, rollout_id: str, maps: Sequence[ColumnMap]) -> Rollout:
    where = source.where(name)
    try:
        table = pd.read_csv(io.BytesIO(source.read(name)), skipinitialspace=True)
    except (ValueError, UnicodeDecodeError) as error:
        raise BadInput(where, "a CSV file with a header", str(error)) from None
    chosen = next((one for one in maps if not _missing(one, table)), None)
    if chosen is None:
        raise BadInput(where, f"the columns {', '.join(_missing(maps[0], table))}", f"only {', '.join(table.columns)}")
    time = _numbers(where, table, (chosen.time,))[:, 0] * SECONDS[chosen.time_unit]
    values = {column: _numbers(where, table, names) for column, names in chosen.columns.items()}
    for column in ANGULAR:
        if column in values and chosen.angle_unit == "deg":
            values[column] = np.deg2rad(values[column])
    if "base_quat" in values and chosen.quat_order == "xyzw":
        values["base_quat"] = np.roll(values["base_quat"], 1, axis=1)
    meta = {"motion": rollout_id} | chosen.meta
    return Rollout(rollout_id, chosen.joints, measured_rate(time), time, **values, meta=meta)


def _missing(one: ColumnMap, table: pd.DataFrame) -> list[str]:
    wanted = [one.time, *(name for names in one.columns.values() for name in names)]
    return [name for name in wanted if name not in table.columns]


def _numbers(where: str, table: pd.DataFrame, names: tuple[str, ...]) -> np.ndarray:
    """(T, len(names)); text that is no number is an error, an empty cell becomes NaN."""
    for name in names:
        if table[name].dtype.kind not in "iuf":
            texts = table[name].astype(str)
            row = int(np.argmax(pd.to_numeric(texts, errors="coerce").isna()))
            raise BadInput(f"{where}: column {name}, row {row}", "a number", repr(texts.iloc[row])[:60])
    return table[list(names)].to_numpy(dtype=np.float64)
