"""The licence of a file: from a table row in SOURCES.md, from a LICENSE file beside it, else "unknown"."""

import re
from functools import cache
from pathlib import Path, PurePosixPath

from bumblebee.errors import BadInput
from bumblebee.io.read import read_bytes
from bumblebee.motion.licences.sources_table import row_of
from bumblebee.motion.licences.terms import UNKNOWN, noncommercial
from bumblebee.motion.reading.archives import SUFFIXES, list_archive
from bumblebee.motion.texts import shown

_MAX_BYTES = 4 << 20  # of a licence or a table
_LONGEST = 200  # characters of a licence's name

# A phrase in the licence's text -> its SPDX name; the first that is found decides.
_TEXTS = (
    ("mit license", "MIT"),
    ("apache license", "Apache-2.0"),
    ("creative commons attribution-noncommercial", "CC-BY-NC-4.0"),
    ("creative commons attribution-sharealike", "CC-BY-SA-4.0"),
    ("creative commons attribution", "CC-BY-4.0"),
    ("cc0", "CC0-1.0"),
    ("redistribution and use in source and binary forms", "BSD-3-Clause"),
    ("gnu general public license", "GPL-3.0"),
)


_FILES = ("LICENSE", "LICENCE", "LICENSE.txt", "LICENCE.txt", "LICENSE.md", "LICENCE.md", "COPYING")
_RATE = re.compile(r"(?:(\d+(?:\.\d+)?)\s*(?:to|and|or|[-/,\u2013])\s*)?\b(\d+(?:\.\d+)?)\s*Hz\b")


def licence_of(file: Path, archive: Path | None = None) -> str:
    """The licence under which a motion file, or a member of an archive, comes.

    A file: its row in SOURCES.md, else a licence file in its folder. A member: the row that names the archive, else
    `<stem>.LICENCE.txt` beside the archive, else a licence file in it, the nearest to the member, else that of the
    archive's folder. A text that is no licence known here but forbids commercial use says so.
    """
    if archive is None:
        return _from_table(file) or _from_folder(file.resolve().parent) or UNKNOWN
    row = row_of(archive)
    named = row is not None and any(name.name == archive.name for name in row.names)
    own = _from_table(archive) if named else ""
    return own or _beside(archive) or _inside(file, archive) or licence_of(archive)


def stated_rate(file: Path, archive: Path | None = None) -> float | None:
    """The frame rate [Hz] that SOURCES.md states for a file, its folder or its archive, where it states exactly one."""
    row = row_of(archive or file)
    if row is None:
        return None
    said = [rate for cell in row.cells.values() for pair in _RATE.findall(cell) for rate in pair if rate]
    rates = {float(rate) for rate in said}
    (rate,) = rates if len(rates) == 1 else (0.0,)
    return rate if 1 <= rate <= 1000 else None


def _from_table(file: Path) -> str:
    """The cell in the column `licence` of the row of SOURCES.md that names the file or its folder."""
    row = row_of(file)
    cells = row.cells if row else {}
    return shown(cells.get("licence") or cells.get("license") or "", _LONGEST)


@cache
def _from_folder(folder: Path) -> str:
    """Licence whose text the licence file of a folder is."""
    return next((found for name in _FILES if (found := _named(name, _text(folder / name)))), "")


def _beside(archive: Path) -> str:
    """Licence in a file that is named after an archive."""
    stem = archive.name[: len(archive.name) - len(next(end for end in SUFFIXES if archive.name.lower().endswith(end)))]
    names = [f"{stem}.{word}{end}" for word in ("LICENCE", "LICENSE") for end in (".txt", ".md", "")]
    return next((found for name in names if (found := _named(name, _text(archive.parent / name)))), "")


def _inside(member: Path, archive: Path) -> str:
    """Licence in a file in a member's folder or one above it in the archive."""
    texts = _archived(archive)
    folders = member.relative_to(archive).parents if texts else []
    return next((texts[str(folder)] for folder in folders if str(folder) in texts), "")


@cache
def _archived(archive: Path) -> dict[str, str]:
    """The licence of each folder of an archive that has a licence file."""
    found: dict[str, str] = {}
    for member in list_archive(archive):
        path = PurePosixPath(member.name)
        if member.bad or path.name not in _FILES or str(path.parent) in found:
            continue
        try:
            text = member.read(_MAX_BYTES).decode("utf-8", errors="replace")
        except BadInput:
            continue
        if licence := _named(path.name, text):
            found[str(path.parent)] = licence
    return found


def _named(name: str, text: str) -> str:
    """The SPDX name of a licence's text, or where it stands; "" of an empty one."""
    plain = " ".join(text.lower().split())
    # Only in a text of no known licence: the GPL has the word too.
    other = f"non-commercial, see {name}" if noncommercial(plain) else f"see {name}"
    return next((spdx for phrase, spdx in _TEXTS if phrase in plain), other) if plain else ""


def _text(path: Path) -> str:
    """A file's text; "" if there is none, or no file that can be read: a licence is then unknown, the motion fine."""
    try:
        return read_bytes(path, _MAX_BYTES).decode("utf-8", errors="replace")
    except BadInput:
        return ""
