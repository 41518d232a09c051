"""Importer of CSV and Parquet logs by a map from the contract's columns to the file's own names.

A column may hold one number, or a list of numbers in each cell, as LeRobot's tables do (`observation.state`).
"""

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pandas as pd
import yaml

from bumblebee.errors import BadInput
from bumblebee.measured.rollout import WIDTHS, Rollout
from bumblebee.measured.source import (
    NO_VELOCITY,
    Source,
    differences,
    measured_rate,
    open_source,
    rollout_names,
)

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
ANGULAR = ("joint_pos", "joint_vel", "joint_target", "base_ang_vel")


@dataclass(frozen=True)
class ColumnMap:
    """Which columns of a CSV hold what; a file takes the first map of a list whose columns it has."""

    joints: tuple[str, ...]
    """Joints of the model, in the order in which the columns are named below."""
    columns: dict[str, tuple[str, ...]]
    """Column of the contract -> names in the file, one a joint or component; or one whose cells are lists of all.

    Without joint_vel velocities are differences of the positions.
    """
    time: tuple[str, ...] = ("time",)
    """Name of the column of time stamps; or of two, of whole seconds and of nanoseconds, as ROS stamps are."""
    time_unit: Literal["s", "ms", "us", "ns"] = "s"
    """Unit of the time stamps; of two columns the first is in s, the second in ns."""
    angle_unit: Literal["rad", "deg"] = "rad"
    """Unit of joint positions, velocities, targets and of the gyro."""
    quat_order: Literal["wxyz", "xyzw"] = "wxyz"
    """Order of base_quat as the file's columns are named in the map."""
    episode: str = ""
    """Column that numbers the episodes where a file holds several; each becomes a rollout."""
    scale: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """Column of the contract -> factors, one a joint, on its values (in rad where they are angles)."""
    offset: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """The same, added after the factors."""
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
    """Every CSV and Parquet file of a folder or zip archive, or one file."""
    source = open_source(place)
    rollouts = []
    for ending in (".csv", ".parquet"):
        names = source.ending(ending)
        ids = rollout_names(names, ending)
        rollouts += [rollout for name in names for rollout in _read(source, name, ids[name], maps)]
    if not rollouts:
        raise BadInput(place, "CSV or Parquet files", "none")
    return rollouts


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
    time = table.get("time", "time")
    time = tuple(map(str, time)) if isinstance(time, list) else (str(time),)
    if len(time) not in (1, 2):
        raise BadInput(f"{path}: time", "a column, or two: seconds and nanoseconds", ", ".join(time) or "none")
    joints = (table["joints"],) if isinstance(table["joints"], str) else tuple(map(str, table["joints"] or ()))
    if not joints or len(set(joints)) < len(joints):
        raise BadInput(f"{path}: joints", "names of joints, each once", ", ".join(joints) or "none")
    columns = {name: (f,) if isinstance(f, str) else tuple(map(str, f or ())) for name, f in table["columns"].items()}
    if "joint_pos" not in columns:
        raise BadInput(f"{path}: columns", "joint_pos", f"only {', '.join(columns)}")
    if not isinstance(table.get("meta", {}), dict):
        raise BadInput(f"{path}: meta", "keys and values", repr(table["meta"])[:60])
    linear = {key: _linear(f"{path}: {key}", table.get(key), len(joints)) for key in ("scale", "offset")}
    return ColumnMap(**(table | {"joints": joints, "columns": columns, "time": time} | linear))


def _linear(where: str, table: Any, width: int) -> dict[str, tuple[float, ...]]:
    """Column -> numbers, one a joint; a single number holds for all."""
    if table is None:
        return {}
    try:
        out = {str(name): tuple(float(x) for x in np.atleast_1d(values)) for name, values in dict(table).items()}
    except (TypeError, ValueError):
        raise BadInput(where, "column -> one number, or one a joint", repr(table)[:60]) from None
    wrong = [name for name, values in out.items() if WIDTHS.get(name) != "J" or len(values) not in (1, width)]
    if wrong:
        raise BadInput(f"{where}: {wrong[0]}", f"a joint column with 1 or {width} numbers", repr(table[wrong[0]])[:60])
    return out


def _read(source: Source, name: str, rollout_id: str, maps: Sequence[ColumnMap]) -> list[Rollout]:
    where = source.where(name)
    table = _table(where, source.read(name), name)
    chosen = next((one for one in maps if not _missing(one, table)), None)
    if chosen is None:
        raise BadInput(where, f"the columns {', '.join(_missing(maps[0], table))}", f"only {', '.join(table.columns)}")
    used = _wanted(chosen)
    table = table[table[used].notna().any(axis=1)]  # rows of nothing but separators
    if not len(table):
        raise BadInput(where, "rows under the header", "none")
    if not chosen.episode:
        return [_rollout(where, table, rollout_id, chosen)]
    parts = table.groupby(chosen.episode, sort=True)
    return [_rollout(where, part, f"{rollout_id}_{_short(key)}", chosen) for key, part in parts]


def _short(key: object) -> str:
    return f"{int(key):04d}" if isinstance(key, int | float | np.number) and float(key).is_integer() else str(key)


def _rollout(where: str, table: pd.DataFrame, rollout_id: str, chosen: ColumnMap) -> Rollout:
    time = _stamps(where, table, chosen)
    count = len(chosen.joints)
    values = {
        column: _numbers(where, table, names, count if WIDTHS[column] == "J" else int(WIDTHS[column]))
        for column, names in chosen.columns.items()
    }
    for column in ANGULAR:
        if column in values and chosen.angle_unit == "deg":
            values[column] = np.deg2rad(values[column])
    for column in values:
        values[column] = values[column] * np.array(chosen.scale.get(column, (1.0,)))
        values[column] = values[column] + np.array(chosen.offset.get(column, (0.0,)))
    if "base_quat" in values and chosen.quat_order == "xyzw":
        values["base_quat"] = np.roll(values["base_quat"], 1, axis=1)
    meta = {"motion": rollout_id} | chosen.meta
    if "joint_vel" not in values:
        values["joint_vel"] = differences(time, values["joint_pos"])
        meta["notes"] = "; ".join(filter(None, (str(meta.get("notes", "")), NO_VELOCITY)))
    return Rollout(rollout_id, chosen.joints, measured_rate(time), time, **values, meta=meta)


def _stamps(where: str, table: pd.DataFrame, chosen: ColumnMap) -> np.ndarray:
    """Time stamps (T,) [s]; seconds since 1970 lose no digits to the nanoseconds beside them."""
    stamps = _numbers(where, table, chosen.time, len(chosen.time))
    if len(chosen.time) == 1:
        return stamps[:, 0] * SECONDS[chosen.time_unit]
    return stamps[:, 0] - stamps[0, 0] + SECONDS["ns"] * stamps[:, 1]


def _table(where: str, content: bytes, name: str) -> pd.DataFrame:
    """A table of a CSV with a header, whatever separates its cells, or of a Parquet file."""
    try:
        if name.lower().endswith(".parquet"):
            return pd.read_parquet(io.BytesIO(content))
        head = content.split(b"\n", 1)[0].decode("utf-8", "replace")
        cut = _separator(head)
        text = {"sep": cut, "decimal": "," if cut == ";" and b"," in content and b"." not in _body(content) else "."}
        return pd.read_csv(io.BytesIO(content), skipinitialspace=True, encoding="utf-8-sig", **text)
    except (ValueError, UnicodeDecodeError, OSError) as error:
        raise BadInput(where, "a CSV file with a header, or a Parquet file", str(error)) from None


def _separator(head: str) -> str:
    """What separates the names of a header: comma, semicolon or tab, whichever is there most often."""
    row = next(csv.reader([head]), [head])
    plain = head if len(row) < 2 else ",".join(row)
    return max((",", ";", "\t"), key=plain.count)


def _body(content: bytes) -> bytes:
    return content.split(b"\n", 1)[-1]


def _wanted(one: ColumnMap) -> list[str]:
    names = [*one.time, *(name for names in one.columns.values() for name in names), one.episode]
    return list(dict.fromkeys(name for name in names if name))


def _missing(one: ColumnMap, table: pd.DataFrame) -> list[str]:
    return [name for name in _wanted(one) if name not in table.columns]


def _numbers(where: str, table: pd.DataFrame, names: tuple[str, ...], width: int) -> np.ndarray:
    """(T, width); text that is no number is an error, an empty cell becomes NaN."""
    if len(names) == 1 and table[names[0]].dtype.kind == "O":
        first = table[names[0]].iloc[0]
        if isinstance(first, list | tuple | np.ndarray) or str(first).lstrip().startswith("["):
            return _lists(f"{where}: column {names[0]}", table[names[0]].tolist(), width)
    if len(names) != width:
        raise BadInput(f"{where}: columns {', '.join(names)}", f"{width} columns, or one of lists", str(len(names)))
    for name in names:
        if table[name].dtype.kind not in "iuf":
            texts = table[name].astype(str)
            row = int(np.argmax(pd.to_numeric(texts, errors="coerce").isna()))
            raise BadInput(f"{where}: column {name}, row {row}", "a number", repr(texts.iloc[row])[:60])
    return table[list(names)].to_numpy(dtype=np.float64)


def _lists(where: str, cells: Sequence[Any], width: int) -> np.ndarray:
    """(T, width) from cells that hold lists, as such or as JSON."""
    out = np.empty((len(cells), width))
    for row, cell in enumerate(cells):
        try:
            values = np.asarray(json.loads(cell) if isinstance(cell, str) else cell, dtype=np.float64).ravel()
        except (ValueError, TypeError):
            raise BadInput(f"{where}, row {row}", f"a list of {width} numbers", repr(cell)[:60]) from None
        if len(values) != width:
            raise BadInput(f"{where}, row {row}", f"{width} values, one a joint", str(len(values)))
        out[row] = values
    return out
