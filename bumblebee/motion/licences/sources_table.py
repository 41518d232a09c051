"""SOURCES.md: a table that says of folders, files and archives where they come from and under which licence."""

import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePosixPath

from bumblebee.errors import BadInput
from bumblebee.io.read import read_bytes

_MAX_BYTES = 4 << 20
_LEVELS = 4  # folders up from the file in which the table is looked for
NAME = "SOURCES.md"


@dataclass(frozen=True)
class Row:
    """A row: what its first cell names, and its cells by their headings in small letters."""

    names: tuple[PurePosixPath, ...]
    cells: dict[str, str]


@lru_cache(maxsize=1024)
def row_of(file: Path) -> Row | None:
    """The row of the nearest table above a file that names it, or a folder that it lies in; the closest one.

    A name in the first cell is a path from the table's folder, or the last part of the folder's or the file's name.
    """
    file = file.resolve()
    for level in file.parents[:_LEVELS]:
        place = PurePosixPath(file.relative_to(level).as_posix())
        rows = _rows(level / NAME, _changed(level / NAME))
        best: tuple[int, Row] | None = None
        for row in rows:
            for name in row.names:
                weight = _weight(name, place, file)
                if weight and (best is None or weight > best[0]):
                    best = weight, row
        if best is not None:
            return best[1]
    return None


def _weight(name: PurePosixPath, place: PurePosixPath, file: Path) -> int:
    """How closely a name means a file: 0 not at all; the file itself before its folder, before folders above."""
    parts = name.parts
    if parts and place.parts[: len(parts)] == parts:
        return 2 * len(parts) + 1
    if name.name in (file.name, file.parent.name):
        return 2 if name.name == file.name else 1
    return 0


@lru_cache(maxsize=64)
def _rows(table: Path, changed: int) -> tuple[Row, ...]:
    """The rows of the tables of a file; none where there is no such file, or none that can be read."""
    try:
        text = read_bytes(table, _MAX_BYTES).decode("utf-8", errors="replace") if changed else ""
    except BadInput:
        return ()
    rows: list[Row] = []
    heads: list[str] = []
    for line in text.splitlines():
        if not line.lstrip().startswith("|"):
            heads = []
            continue
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if not heads:
            heads = [cell.lower() for cell in cells]
        elif not all(set(cell) <= set("-: ") for cell in cells):
            rows.append(Row(_names(cells[0]), dict(zip(heads, cells, strict=False))))
    return tuple(rows)


def _names(cell: str) -> tuple[PurePosixPath, ...]:
    """Names in a first cell: what stands between backticks, or its words."""
    found = re.findall(r"`([^`]+)`", cell) or cell.split()
    return tuple(PurePosixPath(name.strip("()/")) for name in found if name.strip("()/"))


def _changed(path: Path) -> int:
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0
