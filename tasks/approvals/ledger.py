"""Everything that was answered at gates, line by line: each line holds the hash of the one before it.

Lines are only ever added. Who changes or removes an earlier one breaks the chain, and `check` says where. A cut end
breaks no chain: the hash of the last line is kept in the workspace's private folder, too. One process at a time adds a
line, whichever gate it answers: the file itself is locked.
"""

import fcntl
import hashlib
import json
import os
from collections.abc import Mapping
from pathlib import Path
from shlex import join
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.read import read_text
from bumblebee.io.write import unwritable, write_file

NAME = "record.jsonl"
END = Path("..") / ".." / ".servers" / "answers"  # from the record's folder: the private one of the workspace
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
            end = path.parent / END
            end.parent.mkdir(mode=0o700, exist_ok=True)
            write_file(end, _hash(row) + "\n")
    except OSError as error:
        raise unwritable(path, error) from None


def check(folder: Path) -> list[dict[str, Any]]:
    """All entries in order, as {"sha256", "answer"}; a last line that a kill has cut off is taken out of the file.

    Raises:
        BadInput: naming the first line that is not what was written, or that the last answer is gone.
    """
    path = Path(folder) / NAME
    if not path.exists():
        return _entries(b"", path)
    text = _read(path)
    whole = text[: text.rfind(b"\n") + 1]
    if whole != text:
        with path.open("r+b") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            text = file.read()  # whoever was writing has done so
            whole = text[: text.rfind(b"\n") + 1]
            file.truncate(len(whole))
    return _entries(whole, path)


def end_known(folder: Path) -> bool:
    """Whether the last answer is known here, so that a cut end would show."""
    return (Path(folder) / END).exists()


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
    _require_end(found, path)
    return found


def _require_end(found: list[dict[str, Any]], path: Path) -> None:
    if not end_known(path.parent):
        return
    end = Path(os.path.normpath(path.parent / END))
    if read_text(end).strip() not in [entry["sha256"] for entry in found]:
        anew = join(["rm", "-f", str(end), str(path)])
        do = f"Somebody cut it: restore it from a backup, or begin a new one on purpose: {anew}"
        raise BadInput(path, "the last answer that was given", f"{len(found)} answers without it", do)


def _hash(row: str) -> str:
    return hashlib.sha256(row.encode()).hexdigest()
