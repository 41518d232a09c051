"""The gate after an intake: a request that a person answers, and the answer as a file that the next stage depends on.

{"round", "status": "pending" | "approved" | "rejected", "seen": {what the person saw}, "history": [answers]}
"""

import json
import os
import tempfile
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from bumblebee.errors import BadInput
from bumblebee.measured.intake import file_hash
from bumblebee.ranges import Ranged

AUTOMATIC = "automatic (gate.mode: auto)"
SHORT = 12  # digits of a hash that a person copies
STATUSES = ("pending", "approved", "rejected")


@dataclass(frozen=True)
class GateConfig(Ranged):
    """How the gate after each intake is answered."""

    mode: Literal["ask", "auto"] = "ask"
    """ask: a person answers, in the Prefect UI or by one command; auto: the gate answers itself and says so."""


def seen_of(summary: Path) -> dict[str, Any]:
    """What a person sees of an intake, with the hash that binds an answer to it."""
    table = _read(summary)
    keys = ("accepted", "quarantined", "seconds")
    counts = {key: table.get(key) for key in keys}
    return {"sha256": file_hash(summary), **counts, "findings": table.get("by_rule", {})}


def request(path: Path, round: int, summary: Path) -> dict[str, Any]:
    """Ask for an answer. An answer that was given to the same summary stands; given to another, it becomes history."""
    seen = seen_of(summary)
    old = read_approval(path) if Path(path).exists() else None
    if old and old["seen"].get("sha256") == seen["sha256"]:
        return old
    history = [*old["history"], _without_history(old)] if old and old["status"] != "pending" else []
    history = old["history"] if old and old["status"] == "pending" else history
    table = {"round": round, "status": "pending", "seen": seen, "history": history}
    write_json(path, table)
    return table


def answer(path: Path, approve: bool, by: str, note: str = "") -> dict[str, Any]:
    """Approve or reject what the request shows; who, when and what was seen are kept, earlier answers too."""
    old = read_approval(path)
    if not by.strip():
        raise BadInput(path, "who answers", "no name", "Give --by NAME.")
    history = old["history"] if old["status"] == "pending" else [*old["history"], _without_history(old)]
    status = "approved" if approve else "rejected"
    at = datetime.now(UTC).isoformat(timespec="seconds")
    table = {"round": old["round"], "status": status, "by": by.strip(), "at": at, "note": note}
    table |= {"seen": old["seen"], "history": history}
    write_json(path, table)
    return table


def short(table: dict[str, Any]) -> str:
    """The short hash of what a request shows; `--seen` takes it, or more digits of the whole."""
    return str(table["seen"].get("sha256", ""))[:SHORT]


def require_seen(table: dict[str, Any], seen: str) -> None:
    """Refuse an answer that was meant for something else than what the request shows now; "" leaves it open."""
    given = seen.strip().lower()
    if not seen or (len(given) >= SHORT and str(table["seen"].get("sha256", "")).startswith(given)):
        return
    expected = f"{short(table)}, what round {table['round']} shows now"
    do = f"Look again: python -m tasks.gate --round {table['round']} --show."
    raise BadInput("--seen", expected, repr(seen), do)


def what(table: dict[str, Any]) -> str:
    """What an answer is about, in a few words."""
    seen = table["seen"]
    return f"{short(table)} ({seen.get('accepted')} files accepted, {seen.get('quarantined')} set aside)"


def read_approval(path: Path) -> dict[str, Any]:
    """A request or answer, checked."""
    table = _read(path)
    if table.get("status") not in STATUSES:
        raise BadInput(f"{path}: status", f"one of {', '.join(STATUSES)}", repr(table.get("status")))
    if not isinstance(table.get("seen"), dict) or not isinstance(table.get("history"), list):
        raise BadInput(path, "the keys seen and history", ", ".join(sorted(table)))
    return table


def verdict(path: Path, summary: Path) -> str:
    """approved, rejected or pending; an answer to another summary than this one counts as pending."""
    if not Path(path).exists():
        return "pending"
    table = read_approval(path)
    return table["status"] if table["seen"].get("sha256") == file_hash(summary) else "pending"


def how_to_answer(round: int) -> str:
    """The one line that tells a person what to do."""
    command = f"python -m tasks.gate --round {round}"
    return (
        f"round {round} waits for an answer: look with `{command} --show`, "
        f"then `{command} --approve --by NAME` or `{command} --reject --by NAME`"
    )


def write_json(path: Path, table: dict[str, Any]) -> None:
    """Write JSON whole or not at all."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}.", suffix=".part")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.write(json.dumps(table, indent=1, ensure_ascii=False) + "\n")
        os.chmod(name, 0o644)
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise


def _without_history(table: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in table.items() if key != "history"}


def _read(path: Path) -> dict[str, Any]:
    try:
        table = json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise BadInput(path, "a file that the ingest stage writes", "no such file", "Run the ingest stage.") from None
    except (ValueError, UnicodeDecodeError) as error:
        raise BadInput(path, "JSON", f"text that is not ({error})") from None
    if not isinstance(table, dict):
        raise BadInput(path, "a JSON object", type(table).__name__)
    return table
