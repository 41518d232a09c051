"""The gate after an intake: a request that a person answers, and the answer as a file that the next stage depends on.

{"round", "status": "pending" | "approved" | "rejected", "seen": {what the person saw}, "history": [earlier answers]},
and with an answer "by" (the name that was given), "known_by" (how the program knew), "at" and "note". An answer holds
for one summary.json, by its hash. Whoever answers first wins; another answer must say that it changes the first. Where
two people must approve, "approvals" has those of before the last. All answers stand in record.jsonl beside it, too.
"""

import fcntl
import json
import os
import pwd
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal

from bumblebee.errors import BadInput
from bumblebee.io.limits import LIMITS
from bumblebee.io.read import file_hash, read_json
from bumblebee.io.write import unwritable, write_file
from bumblebee.measured import gate_record
from bumblebee.measured import gate_words as words
from bumblebee.measured.gate_people import approvers, login_of, require_allowed
from bumblebee.ranges import Range, Ranged, Text

AUTOMATIC = "automatic (gate.mode: auto)"
STATUSES = ("pending", "approved", "rejected")
SUMMARY_LIMITS = replace(LIMITS, text_bytes=1 << 30, nodes=20_000_000)  # a line for each of many thousand rollouts
LONGEST = 500  # characters of a name or a note


@dataclass(frozen=True)
class GateConfig(Ranged):
    """How the gate after each intake is answered."""

    mode: Literal["ask", "auto"] = "ask"
    """ask: a person answers, in the Prefect UI or by one command; auto: the gate answers itself and says so."""
    people: Annotated[int, Range(least=1, most=9)] = 1
    """People who must approve, each under a login of their own; the rejection of one ends it."""
    group: Annotated[str, Text(empty=True)] = ""
    """Unix group whose members alone may answer; everybody without."""

    def __post_init__(self) -> None:
        """Refuse gates that answer themselves and ask people."""
        super().__post_init__()
        alone = self.mode == "ask" or (self.people == 1 and not self.group)
        self.require(alone, "mode", "ask, where gate.people or gate.group ask for people")


@dataclass(frozen=True)
class Gate:
    """The gate of one round, by its files."""

    workspace: Path
    """The folder with dvc.yaml and params.yaml."""
    round: int
    """The round's number."""

    @property
    def approval(self) -> Path:
        """Where the request and its answer lie."""
        return self.workspace / "data" / "approvals" / f"round-{self.round}.json"

    @property
    def summary(self) -> Path:
        """What the ingest stage showed."""
        return self.workspace / "data" / "measured" / f"r{self.round}" / "summary.json"


@dataclass(frozen=True)
class Author:
    """Who answers, and how that is known."""

    by: str
    """The name that was given: a claim."""
    known_by: dict[str, Any] = field(default_factory=dict)
    """{"how": "unix user", "user", "uid", "host"}, {"how": "automatic"}, or {"how": what else vouches for it}."""


ITSELF = Author(AUTOMATIC, {"how": "automatic"})


def unix_user(by: str) -> Author:
    """Whoever runs this process; the name that they give stands beside it."""
    uid = os.getuid()
    try:
        user = pwd.getpwuid(uid).pw_name
    except KeyError:  # a container may run under a number without a name
        user = str(uid)
    return Author(by, {"how": "unix user", "user": user, "uid": uid, "host": socket.gethostname()})


def seen_of(summary: Path) -> dict[str, Any]:
    """What a person sees of an intake, with the hash that binds an answer to it."""
    table = _read(summary)
    keys = ("accepted", "quarantined", "seconds")
    counts = {key: table.get(key) for key in keys}
    return {"sha256": file_hash(summary), **counts, "findings": table.get("by_rule", {})}


def request(gate: Gate, automatic: bool = False, people: int = 1) -> dict[str, Any]:
    """The request of a round with its answer, if one stands; else a new request, and the old answer is history.

    An answer to another summary does not stand, nor does one that the loop gave itself unless it is `automatic` now,
    nor an approval by fewer than `people`.
    """
    seen = seen_of(gate.summary)
    old = read_approval(gate.approval) if gate.approval.exists() else None
    if old and _stands(old, seen["sha256"], automatic, people):
        return old
    with _locked(gate.approval):
        return _asked(gate, automatic, people)


def settle(gate: Gate, automatic: bool, people: int = 1) -> dict[str, Any]:
    """The request; where the gates answer themselves and nobody else did, with the automatic answer."""
    with _locked(gate.approval):
        table = _asked(gate, automatic, people)
        if automatic and table["status"] == "pending":
            table = _with_answer(table, True, ITSELF, "")
            _keep(gate, table)
        return table


def answer(
    gate: Gate,
    approve: bool,
    author: Author,
    seen: str,
    note: str = "",
    change: bool = False,
    rule: GateConfig = GateConfig(),
) -> dict[str, Any]:
    """Approve or reject what the request shows; who, when and what was seen are kept, earlier answers too.

    Where more people must approve than have, the request goes on waiting and keeps the approval.

    Args:
        gate: the round that is meant.
        approve: whether it may go on.
        author: who answers.
        seen: the hash of what that person saw, at least its first 12 digits.
        note: why.
        change: whether to replace an answer that stands.
        rule: who may answer, and how many must.

    Raises:
        BadInput: for no name, another hash than what lies there now, an answer that stands already, an author who may
            not answer or has approved before.
    """
    if words.one_line(author.by) in ("", "NAME"):
        raise BadInput("--by", "the name of the person who answers", repr(author.by) if author.by else "no name")
    require_allowed(author.known_by, rule.people, rule.group)
    with _locked(gate.approval):
        old = read_approval(gate.approval)
        if old["seen"].get("sha256") != file_hash(gate.summary):
            raise words.other_data(gate.workspace, old, seen)
        words.require_seen(gate.workspace, old, seen)
        if old["status"] != "pending" and not change:
            raise words.answered_already(gate.workspace, old, approve)
        table = _with_answer(old, approve, author, note)
        if approve and rule.people > 1:
            table = _joined(old, table, rule.people)
        _keep(gate, table)
        return table


def verdict(gate: Gate, automatic: bool = False, people: int = 1) -> str:
    """approved, rejected or pending; an answer that does not stand (see `request`) counts as pending."""
    if not gate.approval.exists():
        return "pending"
    table = read_approval(gate.approval)
    return str(table["status"]) if _stands(table, file_hash(gate.summary), automatic, people) else "pending"


def read_approval(path: Path) -> dict[str, Any]:
    """A request or answer, checked."""
    table = _read(path)
    if table.get("status") not in STATUSES:
        raise BadInput(f"{path}: status", f"one of {', '.join(STATUSES)}", repr(table.get("status")))
    if not isinstance(table.get("seen"), dict) or not isinstance(table.get("history"), list):
        raise BadInput(path, "the keys seen and history", ", ".join(sorted(map(str, table))))
    if type(table.get("round")) is not int:
        raise BadInput(f"{path}: round", "the round's number", repr(table.get("round")))
    if table["status"] != "pending" and not all(isinstance(table.get(key), str) for key in ("by", "at", "note")):
        raise BadInput(path, "by, at and note of an answer", ", ".join(sorted(table)))
    if not isinstance(table.get("known_by", {}), dict):
        raise BadInput(f"{path}: known_by", "how the author was known", repr(table["known_by"]))
    return table


def is_automatic(table: dict[str, Any]) -> bool:
    """Whether the loop gave this answer itself; answers of before `known_by` say so by their name."""
    if "known_by" in table:
        return bool(table["known_by"].get("how") == ITSELF.known_by["how"])
    return bool(table.get("by") == AUTOMATIC)


def write_json(path: Path, table: dict[str, Any]) -> None:
    """Write JSON whole or not at all."""
    write_file(Path(path), json.dumps(table, indent=1, ensure_ascii=False) + "\n")


def _stands(table: dict[str, Any], sha256: str, automatic: bool, people: int) -> bool:
    """Whether a request or answer holds for what lies there now, as the gates are answered now."""
    enough = people == 1 or table["status"] != "approved" or len(approvers(table)) >= people
    return table["seen"].get("sha256") == sha256 and (automatic or not is_automatic(table)) and enough


def _asked(gate: Gate, automatic: bool, people: int) -> dict[str, Any]:
    """The request that stands, or a new one, written; the lock is held."""
    seen = seen_of(gate.summary)
    old = read_approval(gate.approval) if gate.approval.exists() else None
    if old and _stands(old, seen["sha256"], automatic, people):
        return old
    table = {"round": gate.round, "status": "pending", "seen": seen, "history": _history(old)}
    write_json(gate.approval, table)
    return table


def _with_answer(old: dict[str, Any], approve: bool, author: Author, note: str) -> dict[str, Any]:
    at = datetime.now(UTC).isoformat(timespec="seconds")
    return {
        **{"round": old["round"], "status": "approved" if approve else "rejected"},
        **{"by": words.one_line(author.by)[:LONGEST], "known_by": author.known_by, "at": at},
        **{"note": words.one_line(note)[:LONGEST], "seen": old["seen"], "history": _history(old)},
    }


def _joined(old: dict[str, Any], table: dict[str, Any], people: int) -> dict[str, Any]:
    """An approval with those of before: the answer where they are enough, a request that waits on where not."""
    earlier = [] if old["status"] != "pending" else old.get("approvals", [])
    who = login_of(table)
    if any(login_of(one) == who for one in earlier):
        raise BadInput(f"round {table['round']}", f"approvals by {people} people", f"a second one by {who}")
    own = {key: table[key] for key in ("status", "by", "known_by", "at", "note")}
    if len(earlier) + 1 < people:
        kept = {key: table[key] for key in ("round", "seen", "history")}
        return kept | {"status": "pending", "approvals": [*earlier, own], "people": people}
    return table | {"approvals": earlier}


def _keep(gate: Gate, table: dict[str, Any]) -> None:
    """Write a table that somebody has answered; the answer stands in the record, too, with what it answers."""
    last = table if table["status"] != "pending" else {**table, **table["approvals"][-1]}
    entry = {key: last[key] for key in ("round", "status", "by", "known_by", "at", "note", "seen")}
    gate_record.append(gate.approval.parent, entry)
    write_json(gate.approval, table)


def _history(old: dict[str, Any] | None) -> list[dict[str, Any]]:
    """All earlier answers, the last one last; a request without an answer leaves none."""
    if old is None or old["status"] == "pending":
        return old["history"] if old else []
    return [*old["history"], {key: value for key, value in old.items() if key != "history"}]


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """One process at a time between reading and writing; the lock is a file beside it, which no stage depends on."""
    lock = path.with_name(f".{path.stem}.lock")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(lock, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    except OSError as error:
        raise unwritable(lock, error) from None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def _read(path: Path) -> dict[str, Any]:
    if not Path(path).exists():
        raise BadInput(path, "a file that the ingest stage writes", "no such file", "Run the ingest stage.")
    table = read_json(path, SUMMARY_LIMITS)
    if not isinstance(table, dict):
        raise BadInput(path, "a JSON object", type(table).__name__)
    return table
