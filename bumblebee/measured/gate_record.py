"""Everything that was answered at gates, line by line: each line holds the hash of the one before it.

Lines are only ever added. Who changes or removes an earlier one breaks the chain, and `check` says where.
"""

import hashlib
import json
import os
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.write import unwritable

NAME = "record.jsonl"
START = "0" * 64


def append(folder: Path, entry: dict[str, Any]) -> None:
    """Add an entry; the gates' lock is held.

    Raises:
        BadInput: if the disk does not take it, or the record is broken.
    """
    path = Path(folder) / NAME
    lines = check(folder)
    row = json.dumps({"before": lines[-1]["sha256"] if lines else START, "answer": entry}, ensure_ascii=False)
    whole = json.dumps({"sha256": _hash(row), "row": row}, ensure_ascii=False) + "\n"
    try:
        with path.open("a", encoding="utf-8") as file:
            file.write(whole)
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise unwritable(path, error) from None


def check(folder: Path) -> list[dict[str, Any]]:
    """All entries in order, as {"sha256", "answer"}; a last line that a kill has cut off is taken out of the file.

    Raises:
        BadInput: naming the first line that is not what was written.
    """
    path = Path(folder) / NAME
    if not path.exists():
        return []
    text = path.read_text(encoding="utf-8")
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        path.write_text(whole, encoding="utf-8")
    found, before = [], START
    for number, line in enumerate(whole.splitlines(), 1):
        try:
            outer = json.loads(line)
            row = json.loads(outer["row"])
            fits = outer["sha256"] == _hash(outer["row"]) and row["before"] == before
        except (ValueError, KeyError, TypeError):
            fits = False
        if not fits:
            do = "Somebody changed it: restore it from a backup."
            raise BadInput(f"{path}, line {number}", "what was written after the line before", "something else", do)
        before = outer["sha256"]
        found.append({"sha256": before, "answer": row["answer"]})
    return found


def _hash(row: str) -> str:
    return hashlib.sha256(row.encode()).hexdigest()
