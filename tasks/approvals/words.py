"""Words of the gate for people: whole commands that work from any folder, and one line for each refusal."""

import os
import shlex
import sysconfig
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput

SHORT = 12  # digits of a hash that a person copies
NOTES = {"approve": "", "reject": " --note WHY", "more": " --note WHAT"}  # what an answer is to say


def short(table: dict[str, Any]) -> str:
    """The short hash of what a request shows; `--seen` takes it, or more digits of the whole."""
    return str(table["seen"].get("sha256", ""))[:SHORT]


def show_command(workspace: Path, table: dict[str, Any]) -> str:
    """Prints what came and how to answer it."""
    return _gate(workspace, table, "show")


def answer_command(workspace: Path, table: dict[str, Any], verb: str) -> str:
    """Answers what the request shows and nothing else; WHY is to be filled in for `reject`, WHAT for `more`."""
    return f"{_gate(workspace, table, verb)} --seen {short(table)}{NOTES[verb]}"


def _gate(workspace: Path, table: dict[str, Any], verb: str) -> str:
    """The command up to its options; it works in any folder and imports nothing that lies there."""
    asked = str(table.get("model") or table["round"])
    return shlex.join([program(), "gate", verb, asked, "--workspace", str(Path(workspace).resolve())])


def program() -> str:
    """Path of this environment's `bumblebee`."""
    return os.path.join(sysconfig.get_path("scripts"), "bumblebee")


def title(table: dict[str, Any]) -> str:
    """Subject of the question, as a sentence begins."""
    return f"promotion of {table['model']}" if "model" in table else f"round {table['round']}"


def go_on(table: dict[str, Any]) -> str:
    """Next command where somebody asked for more."""
    if "model" in table:
        return "publish again with what is wanted: other figures are asked about anew"
    return "add rollouts and start again: changed data are asked about anew"


def how_to_answer(workspace: Path, table: dict[str, Any]) -> str:
    """The one line that tells a person what to do."""
    look = f"look with `{show_command(workspace, table)}`"
    answer = f"`{answer_command(workspace, table, 'approve')}"
    if table["status"] == "more":
        return (
            f"{title(table)} waits for more than {what(table)}: {said(table)}; to go on {go_on(table)}; "
            f"or {look}, and answer all the same with {answer} --change`"
        )
    return (
        f"{title(table)} waits for an answer about {what(table)}{so_far(table)}: {look}, then answer with {answer}`, "
        f"or with `reject` and `--note WHY`, or `more` and `--note WHAT` to ask for more"
    )


def so_far(table: dict[str, Any]) -> str:
    """Who has approved where more people must; "" for nobody."""
    names = [one_line(f"{one['by']} ({known(one)})") for one in table.get("approvals", [])]
    return f", approved by {', '.join(names)}, {len(names)} of {table.get('people', '?')} people" if names else ""


def what(table: dict[str, Any]) -> str:
    """Subject of an answer, in a few words."""
    seen = table["seen"]
    if "model" in table:
        success = "?" if seen.get("success") is None else f"{seen['success']:.3f}"
        return f"{short(table)} (version {seen.get('version')}, success {success}, {seen.get('engine')})"
    return f"{short(table)} ({seen.get('accepted')} files accepted, {seen.get('quarantined')} set aside)"


def known(table: dict[str, Any]) -> str:
    """How the author of an answer was known."""
    facts = table.get("known_by") or {}
    if facts.get("how") == "unix user":
        return f"unix user {facts.get('user')}, uid {facts.get('uid')}, on {facts.get('host')}"
    if facts.get("how") == "personal login":
        return f"personal login {facts.get('user')}"
    return str(facts.get("how") or "not recorded")


def said(table: dict[str, Any]) -> str:
    """An answer in one line: approved by Ada (unix user ada, uid 1000, on lab) at ..., with the note."""
    if "by" not in table:
        return f"{table['status']}{so_far(table)}"
    note = f": {table['note']}" if table.get("note") else ""
    first = "".join(f"{one['by']} ({known(one)}) and " for one in table.get("approvals", []))
    status = "more asked for" if table["status"] == "more" else table["status"]
    return one_line(f"{status} by {first}{table['by']} ({known(table)}) at {table['at']}{note}")


def one_line(text: str) -> str:
    """Text from outside as one printable line."""
    clean = text.encode("utf-8", "replace").decode()
    return " ".join("".join(c if c.isprintable() else " " for c in clean).split())


def require_seen(workspace: Path, table: dict[str, Any], seen: str) -> None:
    """Refuse an answer without the hash of what the request shows now, or with another."""
    given = seen.strip().lower()
    if not given:
        look = f"Look first with `{show_command(workspace, table)}`; it prints the command with the hash."
        raise BadInput("--seen", "the hash of what was looked at", "nothing", look)
    if len(given) < SHORT or not str(table["seen"].get("sha256", "")).startswith(given):
        raise other_data(workspace, table, seen)


def other_data(workspace: Path, table: dict[str, Any], seen: str) -> BadInput:
    """The line for an answer to something else than what lies there now."""
    expected = f"{short(table)}, what {title(table)} of {Path(workspace).resolve()} shows now"
    look = f"Look again with `{show_command(workspace, table)}`."
    return BadInput("--seen", expected, repr(seen), look)


def answered_already(workspace: Path, table: dict[str, Any], verb: str) -> BadInput:
    """The line for an answer where another stands."""
    change = f"To change it: `{answer_command(workspace, table, verb)} --change`."
    return BadInput(title(table), "no answer yet", f"one that was already {said(table)}", change)
