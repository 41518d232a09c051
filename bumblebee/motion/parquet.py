"""Parquet from outside: how much a file says that it unpacks to is asked before anything of it is unpacked."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS, Limits
from bumblebee.io.read import open_file, read_bytes
from bumblebee.motion.texts import LONGEST

Kind = Literal["text", "texts", "whole", "number"]


def read_table(
    path: Path, kinds: Mapping[str, Kind], most_rows: int, limits: Limits = LIMITS, maybe: Sequence[str] = ()
) -> pa.Table:
    """The named columns of a Parquet file, each of its kind and without gaps; those in `maybe` need not be there.

    Raises:
        BadInput: no Parquet, damaged, too large when unpacked, a column missing or of another kind, nulls, long texts.
    """
    data = read_bytes(path, limits.file_bytes)
    try:
        file = _open(pa.BufferReader(data), limits)
        kinds = {name: kind for name, kind in kinds.items() if name not in maybe or name in file.schema_arrow.names}
        _check_rows(path, file.metadata, most_rows)
        _check_size(path, file.metadata, range(file.metadata.num_row_groups), limits)
        _check_kinds(path, file.schema_arrow, kinds, file.metadata.num_rows)
        _check_texts(path, data, kinds, limits)
        table = file.read(columns=list(kinds), use_threads=False)
        table.validate(full=True)
    except BadInput:
        raise
    except Exception as error:  # Arrow raises its own types, OSError, MemoryError, and ValueError for damaged files
        raise _damaged(path, error) from None
    _check_gaps(path, table)
    return table


class Numbers:
    """A Parquet file of real numbers that is read one row group at a time; it stays open until `close`."""

    def __init__(self, path: Path, columns: Sequence[str], most_rows: int, limits: Limits = LIMITS) -> None:
        self.path, self._columns, self._limits = path, list(columns), limits
        stream = open_file(path, limits.file_bytes)
        try:
            self._file = _open(stream, limits, page_checksum_verification=True)
            facts = self._file.metadata
            _check_rows(path, facts, most_rows)
            _check_kinds(path, self._file.schema_arrow, dict.fromkeys(columns, "number"), facts.num_rows)
            self.rows = [facts.row_group(group).num_rows for group in range(facts.num_row_groups)]
            self.notes: Mapping[bytes, bytes] = facts.metadata or {}
        except BaseException as error:
            stream.close()
            if isinstance(error, BadInput) or not isinstance(error, Exception):
                raise
            raise _damaged(path, error) from None
        self._stream = stream

    def read(self, group: int) -> np.ndarray:
        """The row group's columns, (rows, columns), float32; checksums of its pages are compared."""
        try:
            _check_size(self.path, self._file.metadata, [group], self._limits)
            table = self._file.read_row_group(group, columns=self._columns, use_threads=False)
            if table.num_rows != self.rows[group]:
                raise BadInput(self.path, f"{self.rows[group]:,} rows, as it says", f"{table.num_rows:,}")
            _check_gaps(self.path, table)
            values = np.empty((len(self._columns), table.num_rows), dtype=np.float32)
            with np.errstate(over="ignore"):  # what float32 cannot hold becomes infinite, which the reader refuses
                for place, name in enumerate(self._columns):
                    values[place] = table.column(name).to_numpy()
        except BadInput:
            raise
        except Exception as error:
            raise _damaged(self.path, error) from None
        return values.T

    def close(self) -> None:
        """Close the file."""
        self._stream.close()


def _damaged(path: Path, error: Exception) -> BadInput:
    return BadInput(path, "a readable Parquet file", f"{type(error).__name__}: {error}"[:160].replace("\n", " "))


def _open(source: object, limits: Limits, **options: object) -> pq.ParquetFile:
    # Bounds of the file's own directory, which Arrow reads before anybody can ask how large it is.
    bounds = {"thrift_string_size_limit": limits.text_bytes, "thrift_container_size_limit": limits.nodes}
    return pq.ParquetFile(source, **bounds, **options)


def _check_rows(path: Path, facts: pq.FileMetaData, most_rows: int) -> None:
    if facts.num_rows > most_rows:
        raise BadInput(path, f"at most {most_rows:,} rows", f"{facts.num_rows:,}")


def _check_gaps(path: Path, table: pa.Table) -> None:
    for name in table.column_names:
        if table.column(name).null_count:
            raise BadInput(f"{path}: {name}", "a value in every row", f"{table.column(name).null_count} without")


def _check_size(path: Path, facts: pq.FileMetaData, groups: Iterable[int], limits: Limits) -> None:
    unpacked = values = 0
    for group in groups:
        for column in range(facts.num_columns):
            chunk = facts.row_group(group).column(column)
            unpacked += chunk.total_uncompressed_size
            values = max(values, chunk.num_values)
    if unpacked > limits.unpacked_bytes:
        raise BadInput(path, f"a file that unpacks to at most {limits.unpacked_bytes:,} bytes", f"{unpacked:,}")
    if values > limits.rows:
        raise BadInput(path, f"at most {limits.rows:,} values in a column", f"{values:,}")


def _check_kinds(path: Path, schema: pa.Schema, kinds: Mapping[str, Kind], rows: int) -> None:
    for name, kind in kinds.items():
        if schema.names.count(name) != 1:
            came = f"none named {name}" if name not in schema.names else f"two named {name}"
            raise BadInput(path, f"columns {', '.join(kinds)}"[:300], came)
        given = schema.field(name).type
        if not _is(given, kind) and not (rows == 0 and pa.types.is_null(given)):
            raise BadInput(f"{path}: {name}", f"a column of {_WORDS[kind]}", str(given)[:80])


def _is(given: pa.DataType, kind: Kind) -> bool:
    if kind == "whole":
        return pa.types.is_integer(given)
    if kind == "number":
        return pa.types.is_float32(given) or pa.types.is_float64(given)
    if kind == "texts":
        return pa.types.is_list(given) and (_is(given.value_type, "text") or pa.types.is_null(given.value_type))
    return pa.types.is_string(given) or pa.types.is_large_string(given)


_WORDS: dict[Kind, str] = {"text": "text", "texts": "lists of text", "whole": "whole numbers", "number": "real numbers"}


def _check_texts(path: Path, data: bytes, kinds: Mapping[str, Kind], limits: Limits) -> None:
    """Refuse long texts while they are stored once: one of 10 MB, named by a million rows, would be 10 TB unpacked."""
    paths = [name for name, kind in kinds.items() if kind == "text"]
    lists = [name for name, kind in kinds.items() if kind == "texts"]
    if not paths and not lists:
        return
    leaves = _open(pa.BufferReader(data), limits).schema
    inner = [leaves.column(i).path for i in range(len(leaves)) if leaves.column(i).path.split(".")[0] in lists]
    file = _open(pa.BufferReader(data), limits, read_dictionary=[*paths, *inner])
    for name in (*paths, *lists):
        for chunk in file.read(columns=[name], use_threads=False).column(name).chunks:
            values = chunk.flatten() if pa.types.is_list(chunk.type) else chunk
            words = values.dictionary if isinstance(values, pa.DictionaryArray) else values
            longest = pc.max(pc.binary_length(words)).as_py() if len(words) else 0
            if (longest or 0) > LONGEST * 4:
                raise BadInput(f"{path}: {name}", f"texts of at most {LONGEST:,} characters", f"{longest:,} bytes")
