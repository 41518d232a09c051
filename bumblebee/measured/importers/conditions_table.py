"""Conditions of a recording, from a table that a person keeps beside the logs.

Either a CSV whose first column names the log and whose others are conditions by the contract's names (`kp`, `kd`, one
number for all joints or `kp[joint]`; `motion`; conditions such as `supply_voltage`; any other name is a label). Or a
YAML file that says which columns of such a CSV are what:

    table: conditions.csv          # in the source of the logs, or beside this file
    log: file                      # the column that names the log
    values:
      gain: kp_register            # a label
      kp: {column: kp_register, scale: 0.00204966}      # to N m/rad
      supply_voltage: supply_V
      added_mass: {column: load_kg, body: arm, position: [0, 0, -0.1]}
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any

import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.io.read import read_bytes, read_yaml
from bumblebee.measured.conditions import check_conditions
from bumblebee.measured.importers.source import LOGS, Source
from bumblebee.measured.rollout import Rollout
from bumblebee.measured.tables import read_csv, separator

_ENDINGS = (".csv", ".parquet", ".npz", ".mcap", ".db3", ".h5", ".hdf5")
_GAINS = ("kp", "kd")


@dataclass(frozen=True)
class Column:
    """Where a condition's values stand."""

    column: str
    scale: float = 1.0
    body: str = ""
    """That carries an added mass."""
    position: tuple[float, ...] = ()
    """Position of the added mass in the body's frame [m]."""


@dataclass(frozen=True)
class ConditionsTable:
    """Rows of a table, one a log."""

    where: str
    """How messages name it."""
    member: str
    """Its name in the source, if it is there; it is no log."""
    rows: tuple[tuple[str, dict[str, Any]], ...]
    """(log, condition -> value); an empty cell is no condition."""


def read_conditions(path: Path, source: Source) -> ConditionsTable:
    """A CSV, or a YAML file that says where the CSV is and what its columns are."""
    path = Path(path)
    if path.suffix.lower() not in (".yaml", ".yml"):
        frame = _frame(str(path), read_bytes(path, LOGS.file_bytes))
        values = {str(name): Column(str(name)) for name in frame.columns[1:]}
        return _table(str(path), path.name, source, frame, str(frame.columns[0]), values)
    said = read_yaml(path)
    if (
        not isinstance(said, Mapping)
        or set(said) != {"table", "log", "values"}
        or not isinstance(said["values"], Mapping)
    ):
        raise BadInput(path, "table, log and values", repr(said)[:80])
    name = str(said["table"])
    inside = name in source.names
    where = source.where(name) if inside else str(path.parent / name)
    content = source.read(name) if inside else read_bytes(path.parent / name, LOGS.file_bytes)
    columns = {str(key): _column(f"{path}: values: {key}", value) for key, value in said["values"].items()}
    return _table(where, name, source, _frame(where, content), str(said["log"]), columns)


def with_conditions(rollouts: Sequence[Rollout], table: ConditionsTable) -> list[Rollout]:
    """The rollouts with what the table says of them in their metadata; every one must have a row, and every row one."""
    left = dict(table.rows)
    out = []
    for rollout in rollouts:
        log = next((name for name in table_names(rollout.rollout_id) if name in dict(table.rows)), None)
        if log is None:
            raise BadInput(table.where, f"a row for {rollout.rollout_id}", f"only {', '.join(dict(table.rows))}"[:120])
        left.pop(log, None)
        out.append(replace(rollout, meta=rollout.meta | _meta(f"{table.where}: {log}", rollout, dict(table.rows)[log])))
    if left:
        raise BadInput(table.where, "rows of logs that are in the source", repr(next(iter(left)))[:80])
    return out


def with_settings(rollouts: Sequence[Rollout], settings: Sequence[str]) -> list[Rollout]:
    """The rollouts with conditions NAME=VALUE that hold for all of them; a value that reads as a number is one."""
    values: dict[str, Any] = {}
    for text in settings:
        name, _, value = text.partition("=")
        if not name.strip() or not value.strip() or name in values:
            raise BadInput("--set", "NAME=VALUE, a condition of all logs, each once", repr(text)[:80])
        try:
            values[name] = _finite(f"--set {name}", value)
        except ValueError:
            values[name] = value
    return [replace(one, meta=one.meta | _meta("--set", one, values)) for one in rollouts] if values else list(rollouts)


def table_names(rollout_id: str) -> list[str]:
    """By what names a row may mean a rollout: its own, and of an episode that of the whole log."""
    return [rollout_id, *([rollout_id.rsplit("_", 1)[0]] if "_" in rollout_id else [])]


def _meta(where: str, rollout: Rollout, values: Mapping[str, Any]) -> dict[str, Any]:
    """Metadata of the contract."""
    out: dict[str, Any] = {}
    conditions = dict(rollout.meta.get("conditions") or {})
    for name, value in values.items():
        key, _, joint = name.partition("[")
        if key in _GAINS:
            gains = out.setdefault(key, list(rollout.meta.get(key) or [None] * len(rollout.joints)))
            columns = range(len(gains)) if not joint else [_index(f"{where}: {name}", rollout.joints, joint[:-1])]
            for column in columns:
                gains[column] = value
        elif name == "motion":
            out[name] = str(value)
        else:
            conditions[name] = value
    for key in out.keys() & set(_GAINS):
        if not all(isinstance(gain, int | float) for gain in out[key]):
            raise BadInput(f"{where}: {key}", "a number for every joint", repr(out[key])[:80])
    check_conditions(conditions, lambda name, expected, came: BadInput(f"{where}: {name}", expected, came))
    return out | ({"conditions": conditions} if conditions else {})


def _index(where: str, joints: Sequence[str], joint: str) -> int:
    if joint not in joints:
        raise BadInput(where, f"a joint of the log ({', '.join(joints[:8])})", repr(joint)[:80])
    return joints.index(joint)


def _column(where: str, said: object) -> Column:
    if isinstance(said, str):
        return Column(said)
    known = {"column", "scale", "body", "position"}
    if not isinstance(said, Mapping) or "column" not in said or set(said) - known:
        raise BadInput(where, "a column, or column with scale, or with body and position", repr(said)[:80])
    scale, place = said.get("scale", 1.0), said.get("position", [])
    if not isinstance(scale, int | float) or isinstance(scale, bool) or not isinstance(place, list):
        raise BadInput(where, "a number for scale, a list for position", repr(said)[:80])
    return Column(str(said["column"]), _finite(where, scale), str(said.get("body", "")), tuple(place))


def _frame(where: str, content: bytes) -> pd.DataFrame:
    cut = separator(where, content.split(b"\n", 1)[0].decode("utf-8", "replace"))
    frame = read_csv(where, content, LOGS, skipinitialspace=True, sep=cut)
    if len(frame.columns) < 2 or not len(frame):
        raise BadInput(
            where, "a row a log: its name, then conditions", f"{len(frame)} rows, {len(frame.columns)} columns"
        )
    return frame


def _table(
    where: str, member: str, source: Source, frame: pd.DataFrame, log: str, values: Mapping[str, Column]
) -> ConditionsTable:
    for name in (log, *(value.column for value in values.values())):
        if name not in frame.columns:
            raise BadInput(where, f"the column {name}", ", ".join(map(str, frame.columns))[:120])
    names = [_stem(str(name)) for name in frame[log]]
    if len(set(names)) < len(names):
        raise BadInput(f"{where}: column {log}", "every log once", next(n for n in names if names.count(n) > 1))
    rows = []
    for name, (_, row) in zip(names, frame.iterrows(), strict=True):
        found = {key: _value(f"{where}: {name}: {key}", row[c.column], c) for key, c in values.items()}
        rows.append((name, {key: value for key, value in found.items() if value is not None}))
    return ConditionsTable(where, member if member in source.names else "", tuple(rows))


def _value(where: str, cell: Any, column: Column) -> Any:
    """A cell as a number, a text or an added mass; None for an empty one."""
    if pd.isna(cell):
        return None
    value = cell.item() if hasattr(cell, "item") else cell
    value = str(value).lower() if isinstance(value, bool) else value  # pandas reads the text so
    if isinstance(value, str) and (column.scale != 1.0 or column.body):
        raise BadInput(where, "a number", repr(value)[:80])
    if not isinstance(value, str):
        value = _finite(where, value) * column.scale
    if column.body:
        return [{"body": column.body, "kg": value, "position": list(column.position)}] if value else None
    return value


def _finite(where: str, value: Any) -> float:
    """A number of a table or a map as a float."""
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise BadInput(where, "a finite number", repr(value)[:80])
    return number


def _stem(name: str) -> str:
    path = PurePosixPath(name)
    return path.name.removesuffix(path.suffix) if path.suffix.lower() in _ENDINGS else path.name
