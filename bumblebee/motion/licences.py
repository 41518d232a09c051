"""The licence of a file: from a table row in SOURCES.md, from a LICENSE file beside it, else "unknown"."""

import re
from functools import cache
from pathlib import Path

from bumblebee.errors import BadInput
from bumblebee.io.read import read_bytes
from bumblebee.motion.texts import shown

UNKNOWN = "unknown"
_MAX_BYTES = 4 << 20  # of a licence or a table
_LONGEST = 200  # characters of a licence's name
_LEVELS = 4  # folders up from the file in which SOURCES.md is looked for

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


def licence_of(file: Path) -> str:
    """The licence under which a motion file comes."""
    return _of_folder(file.resolve().parent)


@cache
def _of_folder(folder: Path) -> str:
    return _from_table(folder) or _from_text(folder) or UNKNOWN


def _from_table(folder: Path) -> str:
    """The cell in the column `licence` of the row of SOURCES.md whose first cell names the folder."""
    for level in [folder, *folder.parents][:_LEVELS]:
        table = level / "SOURCES.md"
        column = None
        for line in _text(table).splitlines():
            cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
            heads = [cell.lower() for cell in cells]
            if column is None:
                column = next((heads.index(word) for word in ("licence", "license") if word in heads), None)
            elif len(cells) > column and folder.name in re.split(r"[`/\s]+", cells[0]):
                return shown(cells[column], _LONGEST)
    return ""


def _from_text(folder: Path) -> str:
    for name in ("LICENSE", "LICENCE", "LICENSE.txt", "LICENCE.txt", "LICENSE.md", "LICENCE.md", "COPYING"):
        text = " ".join(_text(folder / name).lower().split())
        if text:
            return next((spdx for phrase, spdx in _TEXTS if phrase in text), f"see {name}")
    return ""


def _text(path: Path) -> str:
    """A file's text; "" if there is none, or no file that can be read: a licence is then unknown, the motion fine."""
    try:
        return read_bytes(path, _MAX_BYTES).decode("utf-8", errors="replace")
    except BadInput:
        return ""
