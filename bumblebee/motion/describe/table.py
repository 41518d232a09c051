"""Captions that a user wrote into a CSV file: `motion,caption[,from,to]`, one row a caption."""

import csv
import math
import re
import unicodedata
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePath

from bumblebee.errors import BadInput
from bumblebee.io.read import read_text
from bumblebee.motion.captions import parse_caption, words
from bumblebee.motion.texts import require_line, shown

_NEEDED, _RANGE = ("motion", "caption"), ("from", "to")
_LONGEST = 1000  # characters of a caption, so that its line with tokens stays within `texts.LONGEST`
_ENDING = re.compile(r"(?<=[^/])\.[^./]+$")


@dataclass(frozen=True)
class Row:
    """One caption: its line in the file, the motion as written there, and the caption as a line of `Clip.captions`."""

    number: int
    motion: str
    line: str


@dataclass(frozen=True)
class CaptionTable:
    """The rows by the motion that they name. `bad`: one line for each row that cannot be used."""

    path: Path
    rows: tuple[Row, ...]
    bad: tuple[str, ...]
    _by_motion: dict[str, list[Row]]

    @classmethod
    def read(cls, path: str | Path) -> "CaptionTable":
        """The table in a file of UTF-8 text; a bad row costs no other.

        Raises:
            BadInput: no such file, too large, or other columns.
        """
        path = Path(path)
        lines = read_text(path).splitlines()
        columns = _columns(path, lines[0] if lines else "")
        rows: list[Row] = []
        bad: list[str] = []
        first: dict[tuple[str, str], int] = {}
        for number, line in enumerate(lines[1:], 2):
            if not line.strip():
                continue
            where = f"{path}, line {number}"
            try:
                row = _row(where, number, columns, line)
                if (before := first.setdefault((row.motion, row.line), number)) != number:
                    raise BadInput(where, "a caption once for a motion", f"line {before} again")
            except BadInput as error:
                bad.append(shown(str(error)))
                continue
            rows.append(row)
        by_motion: dict[str, list[Row]] = defaultdict(list)
        for row in rows:
            by_motion[row.motion].append(row)
        return cls(path, tuple(rows), tuple(bad), dict(by_motion))

    def of(self, path: PurePath, motion_name: str) -> list[Row]:
        """The rows of a motion, in their order: by its name, its file's name with or without ending, or a path to it.

        Args:
            path: of its file below the folder that is read; of its end, as many folders as the row says must agree.
            motion_name: its name, where a file holds several.
        """
        names = {_plain(motion_name), *_tails(path)}
        return sorted((row for name in names for row in self._by_motion.get(name, ())), key=lambda row: row.number)


def _tails(path: PurePath) -> Iterator[str]:
    """`a/b/walk.bvh` -> `walk.bvh`, `walk`, `b/walk.bvh`, `b/walk`, ..."""
    parts = [part for part in path.parts if part != path.anchor]
    for first in range(len(parts)):
        whole = _plain("/".join(parts[first:]))
        yield whole
        yield _ENDING.sub("", whole)


def _plain(name: str) -> str:
    """A name as rows and files are compared: one spelling of letters with accents, `/` between folders."""
    return unicodedata.normalize("NFC", name).replace("\\", "/").strip().removeprefix("./")


def _columns(path: Path, header: str) -> list[str]:
    columns = [name.strip().strip('"').lower() for name in header.split(",")]
    wrong = [name for name in columns if name not in _NEEDED + _RANGE or columns.count(name) > 1]
    if not set(_NEEDED) <= set(columns) or wrong or len(set(_RANGE) & set(columns)) == 1:
        raise BadInput(f"{path}, line 1", "the columns motion,caption or motion,caption,from,to", repr(header[:80]))
    return columns


def _row(where: str, number: int, columns: list[str], line: str) -> Row:
    try:
        # Line by line: a quotation mark that is not closed costs its own row, not the rest of the file.
        cells = next(csv.reader([line], strict=True))
    except csv.Error as error:
        raise BadInput(where, "a row of a CSV file", str(error)) from None
    if len(cells) != len(columns):
        remedy = "Put a caption that has commas into quotation marks." if len(cells) > len(columns) else ""
        raise BadInput(where, f"{len(columns)} cells", f"{len(cells)}", remedy)
    row = {name: cell.strip() for name, cell in zip(columns, cells, strict=True)}
    motion, caption = _plain(require_line(where, row["motion"])), require_line(where, row["caption"], _LONGEST)
    if not motion or not caption:
        raise BadInput(where, "a motion and a caption", f"no {'caption' if motion else 'motion'}")
    if "#" in caption:
        raise BadInput(where, "a caption without #", repr(caption[:60]), "It separates the parts of a caption's line.")
    since, until = (_time(where, row.get(name, "")) for name in _RANGE)
    if (since is None) != (until is None) or (since is not None and until is not None and since >= until):
        came = f"{row['from'] or 'nothing'} to {row['to'] or 'nothing'}"
        raise BadInput(where, "both from and to, the earlier first, or neither", came)
    tokens = " ".join(f"{word}/OTHER" for word in words(caption)) or "caption/OTHER"
    entry = f"{caption}#{tokens}#{since or 0.0}#{until or 0.0}"
    parse_caption(entry, where)
    return Row(number, motion, entry)


def _time(where: str, text: str) -> float | None:
    """Seconds; None for an empty cell."""
    if not text:
        return None
    try:
        time = float(text)
    except ValueError:
        time = math.nan
    if not 0 <= time < math.inf:
        raise BadInput(where, "seconds, 0 or more", repr(text)[:40])
    return time
