"""The way to a server for people from elsewhere: each with a login of their own, and with their rights alone.

Behind it the application sees the workspace's own login, which nobody here can use: `accounts.py` and
`rights.py` decide. Answers at gates are taken on the way (`flows/gates/page_answer.py`).
"""

import base64
import binascii
import json
import re
from typing import Any
from urllib.parse import urlsplit

from flows.gates.page_answer import PageAnswers, Unread, once
from flows.people import guard, login
from flows.people.accounts import Busy, People, Person
from flows.people.guard import App, Message, Receive, Send
from flows.people.rights import CANCEL, MAKES_EXPERIMENT, READS, Rights, placed

ON_RUN = re.compile(r"/api/flow_runs/([0-9a-f-]{36})/(resume|set_state)")
FREE = ("/api/health", "/api/ready")  # of Prefect: its page asks before anybody logs in
BODY = 1 << 20  # [bytes] of a request that is read here
DROPPED = (b"authorization", b"origin")  # judged here


class Door:
    """An ASGI application before Prefect's or MLflow's.

    Args:
        app: the application.
        server: "prefect" or "mlflow".
        address: as people open it, `https://HOST[:PORT]`.
        people: who may.
        rights: who may what.
        password: of the workspace's own login, which the application asks for.
        answers: takes answers at gates, for Prefect.
    """

    def __init__(
        self,
        app: App,
        server: str,
        address: str,
        people: People,
        rights: Rights,
        password: str,
        answers: PageAnswers | None = None,
    ) -> None:
        self.app, self.server, self.people, self.rights, self.answers = app, server, people, rights, answers
        host = urlsplit(address).netloc
        self.own = re.compile(re.escape(host) + ("" if ":" in host else "(:443)?"))
        self.password = password
        self.inside = (b"authorization", login.header(password).encode())

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Refuse the request, or hand it on under the workspace's own login."""
        if scope["type"] not in ("http", "websocket"):
            return
        headers = [(name.lower(), value.decode("latin-1")) for name, value in scope["headers"]]
        reads = scope["type"] == "http" and scope["method"] in ("GET", "HEAD")
        if (reason := guard.foreign(headers, reads, self.own, "https")) is not None:
            await guard.refuse(scope, receive, send, 403, reason)
        elif scope["type"] == "websocket":
            await self._socket(scope, receive, send)
        else:
            await self._request(scope, headers, receive, guard.with_headers(send))

    async def _request(self, scope: Message, headers: list[tuple[bytes, str]], receive: Receive, send: Send) -> None:
        method, path = scope["method"], scope["path"]
        if self.server == "prefect" and reads_freely(method, path):
            await self.app(self._scope(scope, None), receive, send)  # the page itself, which then asks for the login
            return
        try:
            who = await self.people.person(given(headers))
        except Busy:
            await guard.reply(send, 429, said("too many wrong passwords: wait a minute"))
            return
        if who is None:
            await self._unknown(scope, receive, send)
        elif (reason := self.rights.refused(self.server, method, path, who.groups)) is not None:
            await guard.reply(send, 403, said(reason))
        elif self.server == "prefect" and (run := ON_RUN.fullmatch(path)):
            await self._on_run(run[1], run[2], who, scope, receive, send)
        elif self.server == "mlflow" and method == "POST" and MAKES_EXPERIMENT.fullmatch(path):
            body = await read_body(receive)
            if body is None or not placed(parsed(body)):
                await guard.reply(send, 403, said("an experiment's files belong into mlflow-artifacts:/FOLDER"))
            else:
                await self.app(self._scope(scope, who), once(body), send)
        else:
            await self.app(self._scope(scope, who), receive, send)

    async def _unknown(self, scope: Message, receive: Receive, send: Send) -> None:
        """A wrong login or none: Prefect says so in its own words, so that its page asks again."""
        if self.server == "prefect":
            await self.app(self._scope(scope, None), receive, send)
        else:
            await guard.reply(send, 401, "a login of your own: `bumblebee lab user add` on the servers' machine")

    async def _on_run(self, run: str, what: str, who: Person, scope: Message, receive: Receive, send: Send) -> None:
        """Resume a run, which may answer a gate, or change its state: everybody may cancel, writers may do more."""
        body = await read_body(receive)
        if body is None:
            await guard.reply(send, 413, said("a shorter request is expected"))
            return
        content = parsed(body)
        inner = self._scope(scope, who)
        if what == "set_state":
            state = content.get("state")
            cancels = isinstance(state, dict) and state.get("type") in CANCEL
            if not cancels and "write" not in self.rights.ranks(who.groups):
                await guard.reply(send, 403, said("a run can be cancelled from elsewhere, not set to another state"))
                return
        elif self.answers is not None:
            try:
                told = await self.answers.take(run, content.get("run_input"), who, inner, self.app, body)
            except Unread:
                await guard.reply(send, 503, said("Prefect does not say what this run asks: try again"))
                return
            if told is not None:
                await guard.reply(send, 200, json.dumps(told))
                return
        await self.app(inner, once(body), send)

    async def _socket(self, scope: Message, receive: Receive, send: Send) -> None:
        """Prefect's sockets bring the login in their first message, which is exchanged for the workspace's own."""
        who: Person | None = None
        first = True

        async def received() -> Message:
            nonlocal who, first
            message = await receive()
            if message["type"] == "websocket.receive" and first:
                first = False
                who = await self._on_socket(scope["path"], message)
                token = login.pair(self.password) if who is not None else ""
                return {"type": "websocket.receive", "text": json.dumps({"type": "auth", "token": token})}
            return message

        async def sent(message: Message) -> None:
            gone = who is not None and self.people.known(who.name) != who
            if gone and message["type"] == "websocket.send":
                message = {"type": "websocket.close", "code": 1008, "reason": "this login is gone"}
            await send(message)

        if self.server != "prefect":
            await guard.refuse(scope, receive, send, 403, "no sockets here")
            return
        await self.app(self._scope(scope, None), received, sent)

    async def _on_socket(self, path: str, message: Message) -> Person | None:
        content = parsed((message.get("text") or "").encode())
        token = content.get("token")
        if content.get("type") != "auth" or not isinstance(token, str):
            return None
        try:
            who = await self.people.person(token)
        except Busy:
            return None
        refused = who is None or self.rights.refused(self.server, "WEBSOCKET", path, who.groups)
        return None if refused else who

    def _scope(self, scope: Message, who: Person | None) -> Message:
        """The request as the application sees it: of the workspace's own login, if somebody is known."""
        kept = [(name, value) for name, value in scope["headers"] if name.lower() not in DROPPED]
        scheme = "https" if scope["type"] == "http" else "wss"  # also behind a proxy
        return {**scope, "scheme": scheme, "headers": [*kept, self.inside] if who is not None else kept}


def reads_freely(method: str, path: str) -> bool:
    """Whether a request is for Prefect's page itself, which holds nothing of anybody's."""
    return method in READS and (path in FREE or not (path == "/api" or path.startswith("/api/")))


def given(headers: list[tuple[bytes, str]]) -> str:
    """`name:password` of the header Authorization; "" where there is none that can be read."""
    values = [value for name, value in headers if name == b"authorization"]
    scheme, _, rest = (values[0] if len(values) == 1 else "").partition(" ")
    if scheme.lower() != "basic":
        return ""
    try:
        return base64.b64decode(rest.strip(), validate=True).decode()
    except (binascii.Error, ValueError):
        return ""


def said(reason: str) -> str:
    """A refusal that the pages and clients of both servers can show."""
    return json.dumps({"detail": reason, "message": reason, "error_code": "PERMISSION_DENIED"})


def parsed(body: bytes) -> dict[str, Any]:
    """A JSON object; empty where there is none."""
    try:
        content = json.loads(body)
    except (ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


async def read_body(receive: Receive) -> bytes | None:
    """The whole body; None where it is too long or the other side went away."""
    body = b""
    while True:
        message = await receive()
        if message["type"] != "http.request":
            return None
        body += message.get("body", b"")
        if len(body) > BODY:
            return None
        if not message.get("more_body", False):
            return body
