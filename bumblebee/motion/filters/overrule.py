"""A person's word against the rules about single motions: a file that is versioned with the parameters.

CSV with the columns `motion, decision, reason, who`, or YAML with a list of such mappings. `decision` is keep or drop;
`motion` is a clip's name, or that of a motion which was cut into pieces, and then holds for all of them. A name that
is not in the library is refused with the nearest names: a slip of the pen would else keep or drop something in silence.
"""

import csv
import difflib
import io
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.read import read_text, read_yaml
from bumblebee.motion.pieces import motion_of
from bumblebee.motion.texts import require_line

COLUMNS = ("motion", "decision", "reason", "who")
DECISIONS = ("keep", "drop")
_MOST = 100_000  # rows


@dataclass(frozen=True)
class Overrule:
    """One row of the file."""

    motion: str
    decision: str
    """"keep" or "drop"."""
    reason: str
    who: str
    row: int
    """Its number, as an editor shows it in a CSV file; in YAML its place in the list, from 1."""


def read_overrules(path: Path) -> list[Overrule]:
    """The rows of the file, complete, each motion once.

    Raises:
        BadInput: for the first row that is not complete, or says something about a motion that another row names, too.
    """
    path = Path(path)
    rows = _yaml_rows(path) if path.suffix.lower() in (".yaml", ".yml") else _csv_rows(path)
    found: dict[str, Overrule] = {}
    for number, row in rows:
        one = _checked(path, number, row)
        if other := found.get(one.motion):
            came = f"{one.decision}, and {other.decision} in row {other.row}"
            raise BadInput(f"{path}, row {number}: {one.motion}", "one row for each motion", came)
        found[one.motion] = one
    return list(found.values())


def by_clip(overrules: Iterable[Overrule], names: Iterable[str], path: Path) -> dict[str, Overrule]:
    """The row that holds for each clip of the library.

    Raises:
        BadInput: for a row that names no clip (with the nearest names, and the other rows that are wrong likewise), and
            for a clip that is named by itself and by the motion which it is a piece of, with different decisions.
    """
    names = list(names)
    pieces: dict[str, list[str]] = {}
    for name in names:
        pieces.setdefault(name, []).append(name)
        if motion_of(name) != name:
            pieces.setdefault(motion_of(name), []).append(name)
    overrules = list(overrules)
    unknown = [one for one in overrules if one.motion not in pieces]
    if unknown:
        near = difflib.get_close_matches(unknown[0].motion, list(pieces), 3, 0.5)
        came = f"{unknown[0].motion!r}"[:80] + (f"; the nearest: {', '.join(near)}" if near else "; nothing like it")
        more = f"The same of rows {', '.join(str(one.row) for one in unknown[1:9])}." if len(unknown) > 1 else ""
        raise BadInput(f"{path}, row {unknown[0].row}: motion", f"one of the {len(names)} motions", came, more)
    found: dict[str, Overrule] = {}
    for one in overrules:
        for name in pieces[one.motion]:
            other = found.setdefault(name, one)
            if other.decision != one.decision:
                came = f"{one.decision} in row {one.row}, {other.decision} in row {other.row}"
                raise BadInput(f"{path}: {name}", "one decision for a motion and its pieces", came)
    return found


def _csv_rows(path: Path) -> list[tuple[int, dict[str, Any]]]:
    reader = csv.DictReader(io.StringIO(read_text(path), newline=""), strict=True)
    try:
        header = [str(name).strip() for name in reader.fieldnames or ()]
        if sorted(header) != sorted(COLUMNS):
            raise BadInput(f"{path}, row 1", f"the columns {', '.join(COLUMNS)}", ", ".join(header)[:80] or "none")
        reader.fieldnames = header
        rows = [(reader.line_num, row) for row in reader]
    except csv.Error as error:
        raise BadInput(f"{path}, row {reader.line_num}", "a CSV file", str(error)) from None
    return _few(path, rows)


def _yaml_rows(path: Path) -> list[tuple[int, dict[str, Any]]]:
    content = read_yaml(path)
    if not isinstance(content, list) or not all(isinstance(row, dict) for row in content):
        raise BadInput(path, f"a list of mappings with {', '.join(COLUMNS)}", type(content).__name__)
    return _few(path, list(enumerate(content, 1)))


def _few(path: Path, rows: list[tuple[int, dict[str, Any]]]) -> list[tuple[int, dict[str, Any]]]:
    if len(rows) > _MOST:
        raise BadInput(path, f"at most {_MOST:,} rows", f"{len(rows):,}")
    return rows


def _checked(path: Path, number: int, row: dict[Any, Any]) -> Overrule:
    """A row with all fields filled."""
    strange = [key for key in row if key not in COLUMNS]
    missing = [key for key in COLUMNS if not isinstance(row.get(key), str) or not row[key].strip()]
    if strange or missing:
        came = f"{missing[0]} without text" if missing else f"more than that: {strange[0]!r}"[:80]
        raise BadInput(f"{path}, row {number}", f"the fields {', '.join(COLUMNS)}", came)
    fields = {key: row[key].strip() for key in COLUMNS}
    for key, text in fields.items():
        require_line(f"{path}, row {number}: {key}", text)
    if fields["decision"] not in DECISIONS:
        raise BadInput(f"{path}, row {number}: decision", " or ".join(DECISIONS), repr(fields["decision"])[:80])
    return Overrule(**fields, row=number)
