"""Importer of CSV and Parquet logs by a map from the contract's columns to the file's own names.

A column may hold one number, or a list of numbers in each cell, as LeRobot's tables do (`observation.state`).
"""

import contextlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bumblebee.errors import BadInput
from bumblebee.io.read import require_real
from bumblebee.measured.importers.column_map import LEFT_OUT, SECONDS, ColumnMap
from bumblebee.measured.importers.mapped import rollouts_of
from bumblebee.measured.importers.source import Source, open_source, rollout_names
from bumblebee.measured.rollout import Rollout
from bumblebee.measured.tables import read_csv, read_parquet, separator


def import_csv(place: Path, maps: Sequence[ColumnMap], no_logs: Sequence[str] = ()) -> list[Rollout]:
    """Every CSV and Parquet file of a folder or zip archive, or one file; but for those that are no logs."""
    source = open_source(place)
    rollouts = []
    for ending in (".csv", ".parquet"):
        names = [name for name in source.ending(ending) if name not in no_logs]
        ids = rollout_names(names, ending)
        rollouts += [rollout for name in names for rollout in read_table(source, name, ids[name], maps)]
    if not rollouts:
        raise BadInput(place, "CSV or Parquet files", "none")
    return rollouts


def read_table(source: Source, name: str, rollout_id: str, maps: Sequence[ColumnMap]) -> list[Rollout]:
    """The rollouts of one CSV or Parquet file by the first map whose columns it has."""
    where = source.where(name)
    table = _table(source, name, maps)
    chosen = next((one for one in maps if not _missing(one, table)), None)
    if chosen is None:
        came, missing = ", ".join(map(str, table.columns[:40])) or "none", _missing(maps[0], table)
        raise BadInput(where, f"the columns {', '.join(missing)}", f"only {came}", _remedy(where, missing, maps[0]))
    table = table[table[_wanted(chosen)].notna().any(axis=1)]  # rows of nothing but separators
    if chosen.valid:
        table = table[table[chosen.valid].fillna(0).astype(bool)]
    if not len(table):
        raise BadInput(where, "rows under the header", "none", "Take the file out of what is imported.")
    if not chosen.episode:
        return _rollouts(where, table, rollout_id, chosen)
    return [
        rollout
        for key, rows in _episodes(f"{where}: column {chosen.episode}", table[chosen.episode], source.limits.members)
        for rollout in _rollouts(f"{where}: episode {key}"[:200], table.iloc[rows], f"{rollout_id}_{key}", chosen)
    ]


def _remedy(where: str, missing: Sequence[str], one: ColumnMap) -> str:
    """How a file comes to have the columns of a map, or out of the way."""
    if set(missing) <= set(one.time):
        return "Name the column of the time stamps in the map, beside `columns`: `time: NAME`."
    if len(missing) < len(_wanted(one)):
        return "Name the columns in the map as the header does."
    if Path(where).stem == "conditions" and Path(where).is_file():
        return f"A table of conditions is an option: --conditions {where}"
    return "The header must be the first line; a file that is no log must be taken out of what is imported."


def _episodes(where: str, cells: pd.Series, most: int) -> list[tuple[str, np.ndarray]]:
    """Name and row numbers of every episode, in the order of the cells; rows without one are the episode "none"."""
    try:
        codes, keys = pd.factorize(cells, sort=False, use_na_sentinel=True)
    except TypeError:
        raise BadInput(where, "a number or a text in every row", "lists") from None
    if len(keys) > most:
        raise BadInput(where, f"at most {most:,} episodes", f"{len(keys):,}")
    order = list(range(len(keys)))
    with contextlib.suppress(TypeError):  # numbers beside texts keep the order in which they come
        order.sort(key=lambda code: keys[code])
    rows = np.split(np.argsort(codes, kind="stable"), np.cumsum(np.bincount(codes + 1, minlength=len(keys) + 1))[:-1])
    named = [(_short(keys[code]), rows[code + 1]) for code in order]
    return [*named, ("none", rows[0])] if len(rows[0]) else named


def _short(key: object) -> str:
    return f"{int(key):04d}" if isinstance(key, int | float | np.number) and float(key).is_integer() else str(key)


def _rollouts(where: str, table: pd.DataFrame, rollout_id: str, chosen: ColumnMap) -> list[Rollout]:
    time = _stamps(where, table, chosen)
    values = {column: _numbers(where, table, names, chosen.width(column)) for column, names in chosen.columns.items()}
    return rollouts_of(where, rollout_id, time, values, chosen)


def _stamps(where: str, table: pd.DataFrame, chosen: ColumnMap) -> np.ndarray:
    """Time stamps (T,) [s]; seconds since 1970 lose no digits to the nanoseconds beside them."""
    if chosen.hz:
        return np.arange(len(table)) / chosen.hz
    stamps = _numbers(where, table, chosen.time, len(chosen.time))
    with np.errstate(all="ignore"):
        if len(chosen.time) == 1:
            return stamps[:, 0] * SECONDS[chosen.time_unit]
        return stamps[:, 0] - stamps[0, 0] + SECONDS["ns"] * stamps[:, 1]


def _table(source: Source, name: str, maps: Sequence[ColumnMap]) -> pd.DataFrame:
    """A table of a CSV with a header, whatever separates its cells, or of a Parquet file."""
    where, content = source.where(name), source.read(name)
    if name.lower().endswith(".parquet"):
        return read_parquet(where, content, [name for one in maps for name in _wanted(one)], source.limits)
    cut = separator(where, content.split(b"\n", 1)[0].decode("utf-8", "replace"))
    decimal = "," if cut == ";" and b"," in content and b"." not in _body(content) else "."
    return read_csv(where, content, source.limits, skipinitialspace=True, sep=cut, decimal=decimal)


def _body(content: bytes) -> bytes:
    return content.split(b"\n", 1)[-1]


def _wanted(one: ColumnMap) -> list[str]:
    names = [
        *(() if one.hz else one.time),
        *(name for names in one.columns.values() for name in names if name != LEFT_OUT),
        one.episode,
        one.valid,
    ]
    return list(dict.fromkeys(name for name in names if name))


def _missing(one: ColumnMap, table: pd.DataFrame) -> list[str]:
    return [name for name in _wanted(one) if name not in table.columns]


def _numbers(where: str, table: pd.DataFrame, names: tuple[str, ...], width: int) -> np.ndarray:
    """(T, width); text that is no number is an error, an empty cell becomes NaN, a column that is not there 0."""
    if len(names) == 1 and table[names[0]].dtype.kind == "O":
        first = table[names[0]].iloc[0]
        if isinstance(first, list | tuple | np.ndarray) or str(first).lstrip().startswith("["):
            return _lists(f"{where}: column {names[0]}", table[names[0]].tolist(), width)
    if len(names) != width:
        raise BadInput(f"{where}: columns {', '.join(names)}", f"{width} columns, or one of lists", str(len(names)))
    there = [place for place, name in enumerate(names) if name != LEFT_OUT]
    named = [names[place] for place in there]
    for name in named:
        if table[name].dtype.kind not in "iuf":
            texts = table[name].astype(str)
            row = int(np.argmax(pd.to_numeric(texts, errors="coerce").isna()))
            raise BadInput(f"{where}: column {name}, row {row}", "a number", repr(texts.iloc[row])[:60])
    out = np.zeros((len(table), width))
    out[:, there] = table[named].to_numpy(dtype=np.float64, na_value=np.nan)
    return out


def _lists(where: str, cells: Sequence[Any], width: int) -> np.ndarray:
    """(T, width) from cells that hold lists, as such or as JSON."""
    out = np.empty((len(cells), width))
    for row, cell in enumerate(cells):
        try:
            given = json.loads(cell) if isinstance(cell, str) else cell
            values = np.asarray(given).ravel()
            if values.dtype.kind == "O":  # null beside numbers
                values = np.asarray(given, dtype=np.float64).ravel()
            values = require_real(f"{where}, row {row}", values)
        except BadInput:
            raise
        except (ValueError, TypeError, RecursionError, OverflowError):
            raise BadInput(f"{where}, row {row}", f"a list of {width} numbers", repr(cell)[:60]) from None
        if len(values) != width:
            raise BadInput(f"{where}, row {row}", f"{width} values, one a joint", str(len(values)))
        out[row] = values
    return out
