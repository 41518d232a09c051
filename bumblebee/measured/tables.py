"""Tables of logs, CSV and Parquet, read only when header and metadata say that they are of a sensible size."""

import csv
import io
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS, Limits
from bumblebee.measured.csv_faults import csv_fault, require_unshifted

_CELL = 8  # bytes of a number in memory
_COLUMNS = 20_000  # a humanoid's log has a few hundred


def read_csv(where: object, content: bytes, limits: Limits = LIMITS, **options: Any) -> pd.DataFrame:
    """A CSV file with a header, as pandas reads it; `options` are pandas'."""
    if b"\0" in content:
        raise BadInput(where, "a CSV file with a header", "binary data")
    head = content.split(b"\n", 1)[0]
    rows, columns = content.count(b"\n"), 1 + max(head.count(sign) for sign in (b",", b";", b"\t"))
    _within(where, rows, columns, limits)
    try:
        _require_once(where, head, options.get("sep", ","))
        table = pd.read_csv(io.BytesIO(content), encoding="utf-8-sig", low_memory=False, **options)
    except BadInput:
        raise
    except Exception as error:  # the parsers raise what they like
        raise csv_fault(where, content, error) from None
    return require_unshifted(where, table)


def _require_once(where: object, head: bytes, cut: str) -> None:
    """Refuse a name that stands twice in the header; pandas makes up another one for the second."""
    names = next(csv.reader([head.decode("utf-8-sig", "replace")], delimiter=cut, skipinitialspace=True), [])
    twice = [name for name, count in Counter(name.strip() for name in names).items() if name and count > 1]
    if twice:
        do = "Rename or remove one of them."
        raise BadInput(f"{where}: column {twice[0]}"[:200], "every column once", "the same name twice", do)


def read_parquet(where: object, content: bytes, wanted: Sequence[str], limits: Limits = LIMITS) -> pd.DataFrame:
    """The wanted columns of a Parquet file, those that it has; what pandas noted in it about indices is left alone."""
    table = arrow_table(where, pa.BufferReader(content), wanted, limits)
    try:
        return table.replace_schema_metadata(None).to_pandas()
    except Exception as error:
        raise BadInput(where, "a Parquet file of numbers", _said(error)) from None


def arrow_table(where: object, source: pa.NativeFile, wanted: Sequence[str], limits: Limits = LIMITS) -> pa.Table:
    """The wanted columns of a Parquet file, after a look at how much its metadata say they hold.

    A column of a billion equal values is a few bytes in Parquet, so rows and values are asked, not only bytes.

    Raises:
        BadInput: damaged or too large; a column twice.
    """
    try:
        with pq.ParquetFile(source) as file:
            names = file.schema_arrow.names
            keep = [name for name in dict.fromkeys(names) if name in set(wanted)]
            _check_size(where, file, keep, limits)
            table = file.read(columns=keep)
    except BadInput:
        raise
    except Exception as error:  # pyarrow raises ArrowException, OSError, ValueError, KeyError, MemoryError
        raise BadInput(where, "a Parquet file", f"bytes that cannot be read as one ({_said(error)})") from None
    repeated = [name for name in keep if names.count(name) > 1]
    if repeated:
        raise BadInput(f"{where}: column {repeated[0]}", "every column once", "the same name twice")
    return table.select(keep) if table.column_names != keep else table


def _check_size(where: object, file: pq.ParquetFile, keep: Sequence[str], limits: Limits) -> None:
    facts = file.metadata
    if facts.num_rows > limits.rows:
        raise BadInput(where, f"at most {limits.rows:,} rows", f"{facts.num_rows:,}")
    if facts.num_columns > _COLUMNS:
        raise BadInput(where, f"at most {_COLUMNS:,} columns", f"{facts.num_columns:,}")
    values = packed = 0
    for group in range(facts.num_row_groups):
        part = facts.row_group(group)
        for place in range(part.num_columns):
            column = part.column(place)
            if column.path_in_schema.split(".", 1)[0] in keep:
                values += max(column.num_values, 0)
                packed += max(column.total_uncompressed_size, 0)
    # A fixed-size list has as many numbers as its type says, however few the file claims to hold.
    listed = facts.num_rows * sum(_width(file.schema_arrow.field(name).type) for name in keep)
    size = max(packed, _CELL * values, _CELL * listed)
    if size > limits.unpacked_bytes:
        raise BadInput(where, f"a table of at most {limits.unpacked_bytes:,} bytes", f"{size:,}")


def _width(kind: pa.DataType) -> int:
    width = 1
    while pa.types.is_fixed_size_list(kind):
        width, kind = width * max(kind.list_size, 1), kind.value_type
    return width


def _within(where: object, rows: int, columns: int, limits: Limits) -> None:
    for what, came, most in (("rows", rows, limits.rows), ("columns", columns, _COLUMNS)):
        if came > most:
            raise BadInput(where, f"at most {most:,} {what}", f"{came:,}")
    if _CELL * rows * columns > limits.unpacked_bytes:
        raise BadInput(where, f"at most {limits.unpacked_bytes // _CELL:,} cells", f"{rows * columns:,}")


def separator(where: object, head: str) -> str:
    """Separator of the names of a header: comma, semicolon or tab, whichever is there most often."""
    try:
        row = next(csv.reader([head]), [head])
    except csv.Error as error:
        raise BadInput(where, "a header of names", str(error)) from None
    plain = head if len(row) < 2 else ",".join(row)
    return max((",", ";", "\t"), key=plain.count)


def require_finite(where: object, values: np.ndarray) -> np.ndarray:
    """The values, if none is NaN or infinite; the message names the first row that has one."""
    bad = ~np.isfinite(values)
    if bad.any():
        place = tuple(int(i) for i in np.argwhere(bad)[0])
        row = f", row {place[0]}" if place else ""
        raise BadInput(f"{where}{row}", "finite numbers", f"{values[place]} ({int(bad.sum())} such values)")
    return values


def _said(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"[:200]
