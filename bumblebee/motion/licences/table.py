"""LICENCES.csv: what a folder of converted motions says of each file, so that licences, sources and rates travel on."""

import csv
import io
import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.io.read import read_text
from bumblebee.motion.texts import shown

LICENCES = "LICENCES.csv"
_HEAD = ("file", "motion", "fps", "source", "licence")
_LONGEST = 300  # characters of a source or a licence


@dataclass(frozen=True)
class Stated:
    """Row of the table on one file."""

    file: str
    motion: str
    fps: float
    """Rate of the motion in the file [Hz]."""
    source: str
    licence: str


def table_of(rows: Iterable[Stated]) -> str:
    """The table as text."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_HEAD)
    for row in rows:
        writer.writerow((row.file, row.motion, f"{row.fps:.10g}", row.source, row.licence))
    return text.getvalue()


def read_table(folder: Path) -> dict[str, Stated]:
    """The table in a folder by file; empty where there is none of this kind."""
    path = Path(folder) / LICENCES
    try:
        facts = path.stat()
    except OSError:
        return {}
    return _read(path, facts.st_mtime_ns, facts.st_size)


def stated_of(file: Path) -> Stated | None:
    """Row about a file in the table beside it."""
    return read_table(file.parent).get(file.name)


@lru_cache(maxsize=64)
def _read(path: Path, *_: int) -> dict[str, Stated]:
    try:
        rows = list(csv.reader(io.StringIO(read_text(path))))
    except (BadInput, csv.Error):
        return {}
    if not rows or tuple(rows[0]) != _HEAD:
        return {}
    found = {}
    for row in rows[1:]:
        if len(row) == len(_HEAD) and (fps := _number(row[2])) is not None:
            found[row[0]] = Stated(row[0], row[1], fps, shown(row[3], _LONGEST), shown(row[4], _LONGEST))
    return found


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) and 1 <= value <= 1000 else None
