"""Answers at a gate from Prefect's page, under the login of who gave them; taken before Prefect resumes the run.

The answer stands in the workspace's record when the page is told so: whatever is killed after that, it counts. The run
finds it there when it goes on, and needs to believe nothing that Prefect's database says of its author.
"""

import asyncio
import json
import re
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput
from flows.people.accounts import Person
from flows.people.guard import App, Message, Receive
from tasks.approvals import gate, words
from tasks.approvals.people import login_of
from tasks.gate import asked, rule

QUESTION = re.compile(r"gate-([1-9][0-9]{0,8})-([0-9a-f]{12})-[0-9]+")  # `gate_question.pause_key`


class Unread(Exception):
    """Prefect does not say what a run asks: there is none, or its database is away."""


class PageAnswers:
    """Takes the answers of one workspace."""

    def __init__(self, workspace: Path) -> None:
        self.workspace = workspace

    async def take(
        self, run: str, values: Any, who: Person, scope: Message, app: App, body: bytes
    ) -> dict[str, Any] | None:
        """Text for the page instead of resuming the run; None where it shall be resumed.

        Args:
            run: its number.
            values: what was filled in.
            who: by whom.
            scope: of the request that resumes the run.
            app: Prefect's.
            body: of that request.

        Raises:
            Unread: when it cannot be known what the run asks.
        """
        found = await call(app, {**scope, "method": "GET", "path": f"/api/flow_runs/{run}"})
        if found is None:
            raise Unread
        state = json.loads(found).get("state") or {}
        question = QUESTION.fullmatch(str((state.get("state_details") or {}).get("pause_key")))
        if state.get("type") != "PAUSED" or question is None or not isinstance(values, dict):
            return None
        place = gate.Gate(self.workspace, int(question[1]))
        if not place.summary.exists() or not place.sha256().startswith(question[2]):
            return None  # of another workspace, or about data that changed: the run asks anew
        reason, waits = await asyncio.to_thread(answer, place, values, who)
        if reason is None:
            return None
        if not waits:  # answered before: the run must not wait on for what stands
            await call(app, {**scope, "method": "POST"}, body)
        return {"state": state, "status": "REJECT", "details": {"type": "reject_details", "reason": reason}}


def answer(place: gate.Gate, values: dict[str, Any], who: Person) -> tuple[str | None, bool]:
    """Write an answer; (what to say instead of "resumed", whether the run waits on)."""
    verb, by, seen, note = (str(values.get(key) or "")[: gate.LONGEST] for key in ("answer", "by", "seen", "note"))
    author = gate.Author(by or who.name, gate.personal(who.name, who.groups))
    try:
        if verb not in gate.ANSWERS:
            raise BadInput("the answer", " or ".join(gate.ANSWERS), repr(verb[:80]))
        asked(place)
        table = gate.decide(place, verb, author, seen, note, rule=rule(place.workspace))
    except BadInput as error:
        stands = asked(place)
        if stands["status"] == gate.ANSWERS.get(verb) and login_of(stands) == who.name:
            return None, False  # their own, sent again, since the run did not go on
        return str(error), stands["status"] == "pending"
    if table["status"] == "pending":
        return f"{words.said(table)}: your answer is kept, the run waits for the others", True
    return None, False


async def call(app: App, scope: Message, body: bytes = b"") -> bytes | None:
    """Answer of an application to a request of ours; None where that is not what was wanted."""
    status, parts = 0, []

    async def send(message: Message) -> None:
        nonlocal status
        status = message.get("status", status)
        parts.append(message.get("body", b""))

    kept = [(name, value) for name, value in scope["headers"] if name.lower() not in LENGTHS]
    headers = [*kept, (b"content-length", str(len(body)).encode()), (b"content-type", b"application/json")]
    await app({**scope, "headers": headers, "raw_path": scope["path"].encode(), "query_string": b""}, once(body), send)
    return b"".join(parts) if status in (200, 201) else None


def once(body: bytes) -> Receive:
    """Receiver for an application where the body has been read already; then nothing."""
    left = [body]

    async def receive() -> Message:
        if not left:
            await asyncio.Event().wait()
        return {"type": "http.request", "body": left.pop(), "more_body": False}

    return receive


LENGTHS = (b"content-length", b"content-type", b"accept-encoding", b"transfer-encoding")
