"""Gates: a request that a person answers, and the answer as a file, on which the stage after an intake depends.

A person approves, rejects, or asks for more rollouts; what the file says of it stands in `table`. An answer holds
for one summary.json, by its hash. Whoever answers first wins; another answer must say that it changes the first. All
answers stand in record.jsonl beside it, too, and one counts from when it stands there.
"""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Protocol

from bumblebee.errors import BadInput
from bumblebee.io.read import file_hash
from bumblebee.io.write import unwritable
from bumblebee.ranges import Range, Ranged, Text
from tasks.approvals import ledger, words
from tasks.approvals.people import (
    AUTOMATIC,
    ITSELF,
    Author,
    is_automatic,
    personal,
    require_allowed,
    unix_user,
)
from tasks.approvals.table import (
    LONGEST,
    OF_ANSWER,
    STATUSES,
    SUMMARY_LIMITS,
    WAITS,
    history,
    holds,
    joined,
    read_approval,
    read_object,
    stands,
    with_answer,
    write_json,
)

__all__ = [
    "ANSWERS",
    "AUTOMATIC",
    "ITSELF",
    "LONGEST",
    "STATUSES",
    "SUMMARY_LIMITS",
    "WAITS",
    "Author",
    "Gate",
    "GateConfig",
    "answer",
    "decide",
    "is_automatic",
    "personal",
    "read_approval",
    "request",
    "seen_of",
    "settle",
    "unix_user",
    "verdict",
    "write_json",
]

ANSWERS = {"approve": "approved", "reject": "rejected", "more": "more"}
"""Status of the request for each answer of a person."""


@dataclass(frozen=True)
class GateConfig(Ranged):
    """How the gate after each intake is answered."""

    section = "gate"  # of params.yaml; no field

    mode: Literal["ask", "auto"] = "ask"
    """ask: a person answers, in the Prefect UI or by one command; auto: the gate answers itself and says so."""
    people: Annotated[int, Range(least=1, most=9)] = 1
    """People who must approve, each under a login of their own; the rejection of one ends it."""
    group: Annotated[str, Text(empty=True)] = ""
    """Unix group whose members alone may answer, and people with this group; everybody without."""

    def __post_init__(self) -> None:
        """Refuse gates that answer themselves and ask people."""
        super().__post_init__()
        alone = self.mode == "ask" or (self.people == 1 and not self.group)
        self.require(alone, "mode", "ask, where people or group ask for people")


class Question(Protocol):
    """Question that people are asked."""

    @property
    def workspace(self) -> Path:
        """The folder with dvc.yaml and params.yaml."""

    @property
    def approval(self) -> Path:
        """Where the request and its answer lie."""

    @property
    def subject(self) -> dict[str, Any]:
        """Keys that tell this gate's answers from others in the record."""

    def seen(self) -> dict[str, Any]:
        """Summary that a person sees of what lies there now, with its hash."""

    def sha256(self) -> str:
        """The hash of it."""


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
        """Summary that the ingest stage showed."""
        return self.workspace / "data" / "measured" / f"r{self.round}" / "summary.json"

    @property
    def subject(self) -> dict[str, Any]:
        """Keys that tell this gate's answers from others in the record."""
        return {"round": self.round}

    def seen(self) -> dict[str, Any]:
        """Summary that a person sees of what lies there now."""
        return seen_of(self.summary)

    def sha256(self) -> str:
        """The hash of it."""
        return file_hash(self.summary)


def seen_of(summary: Path) -> dict[str, Any]:
    """Summary that a person sees of an intake, with the hash that binds an answer to it."""
    table = read_object(summary)
    keys = ("accepted", "quarantined", "seconds")
    counts = {key: table.get(key) for key in keys}
    return {"sha256": file_hash(summary), **counts, "findings": table.get("by_rule", {})}


def request(gate: Question, automatic: bool = False, people: int = 1) -> dict[str, Any]:
    """The request with its answer, if one stands (`table.stands`); else a new one: the old answer is history."""
    old = read_approval(gate.approval) if gate.approval.exists() else None
    if old and stands(old, gate.sha256(), automatic, people) and _recorded_alone(gate, old) is None:
        return old
    with _locked(gate.approval):
        return _asked(gate, automatic, people)


def settle(gate: Question, automatic: bool, people: int = 1) -> dict[str, Any]:
    """The request; where the gates answer themselves and nobody else did, with the automatic answer."""
    with _locked(gate.approval):
        table = _asked(gate, automatic, people)
        if automatic and table["status"] == "pending":
            table = with_answer(table, "approved", ITSELF, "", 1)
            _keep(gate, table)
        return table


def answer(
    gate: Question,
    approve: bool,
    author: Author,
    seen: str,
    note: str = "",
    change: bool = False,
    rule: GateConfig = GateConfig(),
) -> dict[str, Any]:
    """Approve or reject what the request shows; see `decide`."""
    return decide(gate, "approve" if approve else "reject", author, seen, note, change, rule)


def decide(
    gate: Question,
    verb: str,
    author: Author,
    seen: str,
    note: str = "",
    change: bool = False,
    rule: GateConfig = GateConfig(),
) -> dict[str, Any]:
    """Answer what the request shows; who, when and what was seen are kept, earlier answers too.

    Where more people must approve than have, the request goes on waiting and keeps the approval. It also waits on when
    somebody asks for more; approvals from before that count no more.

    Args:
        gate: the round, or the promotion, that is meant.
        verb: one of `ANSWERS`.
        author: who answers.
        seen: the hash of what that person saw, at least its first 12 digits.
        note: why; what is wanted, for `more`.
        change: whether to replace an answer that stands.
        rule: who may answer, and how many must.

    Raises:
        BadInput: for no name, another hash than what lies there now, an answer that stands already, an author who may
            not answer or has approved before, or more of nothing.
    """
    if words.one_line(author.by) in ("", "NAME"):
        raise BadInput("--by", "the name of the person who answers", repr(author.by) if author.by else "no name")
    if verb == "more" and not words.one_line(note):
        raise BadInput("--note", "what is wanted", "nothing", "Say which rollouts are missing.")
    require_allowed(author.known_by, rule.people, rule.group, rule.section)
    with _locked(gate.approval):
        old = read_approval(gate.approval)
        if old["seen"].get("sha256") != gate.sha256():
            raise words.other_data(gate.workspace, old, seen)
        words.require_seen(gate.workspace, old, seen)
        old = _caught_up(gate, old, rule.people)
        if old["status"] != "pending" and not change:
            raise words.answered_already(gate.workspace, old, verb)
        table = with_answer(old, ANSWERS[verb], author, note, rule.people)
        _keep(gate, table)
        return table


def verdict(gate: Question, automatic: bool = False, people: int = 1) -> str:
    """approved, rejected, more or pending; an answer that does not stand (see `request`) counts as pending."""
    if not gate.approval.exists():
        return "pending"
    table = read_approval(gate.approval)
    return str(table["status"]) if stands(table, gate.sha256(), automatic, people) else "pending"


def _asked(gate: Question, automatic: bool, people: int) -> dict[str, Any]:
    """The request that stands, or a new one, written; the lock is held."""
    old = read_approval(gate.approval) if gate.approval.exists() else None
    if old is not None:
        old = _caught_up(gate, old, people)
    seen = gate.seen()
    if old and stands(old, seen["sha256"], automatic, people):
        return old
    table = {**gate.subject, "status": "pending", "seen": seen, "history": history(old)}
    write_json(gate.approval, table)
    return table


def _caught_up(gate: Question, old: dict[str, Any], people: int) -> dict[str, Any]:
    """The table with an answer that stands in the record alone, since a kill came after that; the lock is held."""
    left = _recorded_alone(gate, old)
    if left is None:
        return old
    table = joined(old, left, people)
    write_json(gate.approval, table)
    return table


def _recorded_alone(gate: Question, old: dict[str, Any]) -> dict[str, Any] | None:
    """The record's last answer to what the table shows, where the table does not have it."""
    entry = ledger.last(gate.approval.parent, gate.subject)
    if entry is None or entry["seen"].get("sha256") != old["seen"].get("sha256") or holds(old, entry):
        return None
    return {key: entry[key] for key in OF_ANSWER}


def _keep(gate: Question, table: dict[str, Any]) -> None:
    """Write a table that somebody has answered; the answer stands in the record, too, with what it answers."""
    last = table if table["status"] != "pending" else {**table, **table["approvals"][-1]}
    entry = {key: last[key] for key in (*gate.subject, *OF_ANSWER, "seen")}
    ledger.append(gate.approval.parent, entry)
    write_json(gate.approval, table)


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
