"""A request at a gate and its answer, as a table: what an answer makes of it, whether it stands, and its file.

{"round", "status": "pending" | "more" | "approved" | "rejected", "seen": {what was shown}, "history": [earlier
answers]}, and with an answer "by" (the name that was given), "known_by" (how the program knew), "at" and "note". With
"more" somebody wants more before anybody judges: it waits on. Where two people must approve, "approvals" has those
before the last.
"""

import json
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS
from bumblebee.io.read import read_json
from bumblebee.io.write import write_file
from tasks.approvals import words
from tasks.approvals.people import Author, approvers, is_automatic, login_of

Table = dict[str, Any]
WAITS = ("pending", "more")
STATUSES = (*WAITS, "approved", "rejected")
OF_ANSWER = ("status", "by", "known_by", "at", "note")
SUMMARY_LIMITS = replace(LIMITS, text_bytes=1 << 30, nodes=20_000_000)  # a line for each of many thousand rollouts
LONGEST = 500  # characters of a name or a note


def stands(table: Table, sha256: str, automatic: bool, people: int) -> bool:
    """Whether a request or answer holds for what lies there now, as the gates are answered now.

    An answer to something else does not stand, nor does one that the loop gave itself unless it is `automatic` now, nor
    an approval by fewer than `people`.
    """
    enough = people == 1 or table["status"] != "approved" or len(approvers(table)) >= people
    return table["seen"].get("sha256") == sha256 and (automatic or not is_automatic(table)) and enough


def with_answer(old: Table, status: str, author: Author, note: str, people: int) -> Table:
    """The table after an answer that is given now; see `joined`."""
    at = datetime.now(UTC).isoformat(timespec="seconds")
    given = {"status": status, "by": words.one_line(author.by)[:LONGEST], "known_by": author.known_by, "at": at}
    return joined(old, given | {"note": words.one_line(note)[:LONGEST]}, people)


def joined(old: Table, given: Table, people: int) -> Table:
    """The table after an answer. An approval joins those of before, and is the answer once they are enough.

    Whatever else is answered ends that: earlier approvals are history, and whoever still approves says so again.

    Args:
        old: the table before.
        given: the answer, with the keys of `OF_ANSWER`.
        people: how many must approve.

    Raises:
        BadInput: for a second approval under one login.
    """
    kept = {key: value for key, value in old.items() if key in ("round", "model", "seen")}
    if given["status"] != "approved" or people == 1:
        return {**kept, **given, "history": history(old)}
    earlier = old.get("approvals", []) if old["status"] == "pending" else []
    past = old["history"] if old["status"] == "pending" else history(old)
    who = login_of(given)
    if any(login_of(one) == who for one in earlier):
        raise BadInput(words.title(old), f"approvals by {people} people", f"a second one by {who}")
    if len(earlier) + 1 < people:
        return {**kept, "history": past, "status": "pending", "approvals": [*earlier, given], "people": people}
    return {**kept, **given, "history": past, "approvals": earlier}


def history(old: Table | None) -> list[Table]:
    """All earlier answers, the last one last; approvals too that others were to join."""
    if old is None:
        return []
    if old["status"] == "pending":
        return [*old["history"], *({**one, "seen": old["seen"]} for one in old.get("approvals", []))]
    return [*old["history"], {key: value for key, value in old.items() if key != "history"}]


def holds(table: Table, given: Table) -> bool:
    """Whether an answer is the table's own, or one before it."""
    kept = [table, *table.get("approvals", [])]
    for old in table["history"]:
        kept += [old, *old.get("approvals", [])]
    return any(all(one.get(key) == given.get(key) for key in ("status", "by", "at", "note")) for one in kept)


def read_approval(path: Path) -> Table:
    """A request or answer, checked."""
    table = read_object(path)
    if table.get("status") not in STATUSES:
        raise BadInput(f"{path}: status", f"one of {', '.join(STATUSES)}", repr(table.get("status")))
    if not isinstance(table.get("seen"), dict) or not isinstance(table.get("history"), list):
        raise BadInput(path, "the keys seen and history", ", ".join(sorted(map(str, table))))
    if type(table.get("round")) is not int and not isinstance(table.get("model"), str):
        raise BadInput(f"{path}: round", "the round's number", repr(table.get("round")))
    if table["status"] != "pending" and not all(isinstance(table.get(key), str) for key in ("by", "at", "note")):
        raise BadInput(path, "by, at and note of an answer", ", ".join(sorted(table)))
    if not isinstance(table.get("known_by", {}), dict):
        raise BadInput(f"{path}: known_by", "how the author was known", repr(table["known_by"]))
    return table


def read_object(path: Path) -> Table:
    """A JSON object that a stage wrote."""
    if not Path(path).exists():
        raise BadInput(path, "a file that the ingest stage writes", "no such file", "Run the ingest stage.")
    table = read_json(path, SUMMARY_LIMITS)
    if not isinstance(table, dict):
        raise BadInput(path, "a JSON object", type(table).__name__)
    return table


def write_json(path: Path, table: Table) -> None:
    """Write JSON whole or not at all."""
    write_file(Path(path), json.dumps(table, indent=1, ensure_ascii=False) + "\n")
