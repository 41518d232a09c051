"""Everything that was answered at gates, line by line: each line holds the hash of the one before it.

Lines are only ever added. Who changes or removes an earlier one breaks the chain, and `check` says where. One process
at a time adds a line, whichever gate it answers: the file itself is locked.
"""

import fcntl
import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.write import unwritable

NAME = "record.jsonl"
START = "0" * 64


def append(folder: Path, entry: dict[str, Any]) -> None:
    """Add an entry.

    Raises:
        BadInput: if the disk does not take it, or the record is broken.
    """
    path = Path(folder) / NAME
    try:
        with path.open("a+b") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            file.seek(0)
            text = file.read()
            whole = text[: text.rfind(b"\n") + 1]
            lines = _entries(whole, path)
            if whole != text:
                file.truncate(len(whole))
            row = json.dumps({"before": lines[-1]["sha256"] if lines else START, "answer": entry}, ensure_ascii=False)
            added = json.dumps({"sha256": _hash(row), "row": row}, ensure_ascii=False) + "\n"
            file.write(added.encode())
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
    text = _read(path)
    whole = text[: text.rfind(b"\n") + 1]
    if whole != text:
        with path.open("r+b") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            text = file.read()  # whoever was writing has done so
            whole = text[: text.rfind(b"\n") + 1]
            file.truncate(len(whole))
    return _entries(whole, path)


def last(folder: Path, subject: Mapping[str, Any]) -> dict[str, Any] | None:
    """The last answer to a gate, as far as the record is what was written."""
    path = Path(folder) / NAME
    if not path.exists():
        return None
    text = _read(path)
    try:
        entries = _entries(text[: text.rfind(b"\n") + 1], path)
    except BadInput:
        return None  # `check` names it, and nothing is added to it
    about = (one["answer"] for one in reversed(entries))
    return next((one for one in about if all(one.get(key) == value for key, value in subject.items())), None)


def _read(path: Path) -> bytes:
    with path.open("rb") as file:
        fcntl.flock(file, fcntl.LOCK_SH)
        return file.read()


def _entries(text: bytes, path: Path) -> list[dict[str, Any]]:
    """The chain's entries, up to the first line that breaks it."""
    found: list[dict[str, Any]] = []
    before = START
    for number, line in enumerate(text.split(b"\n")[:-1], 1):
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
