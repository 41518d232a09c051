"""Guard before both servers' applications: own pages only, with a login, and a page that calls nobody else.

A request must name this machine as its host (a foreign name that resolves to it is DNS rebinding), and where a browser
says which page it comes from, that must be a page of the same server.
"""

import hashlib
import hmac
import re
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any
from urllib.parse import parse_qs

from flows.people import login

ALIVE = "/.alive"  # answers without login, with a proof that it knows the password
OWN_HOST = re.compile(r"(127\.0\.0\.1|localhost|\[::1\])(:\d{1,5})?")  # any port: a tunnel may lead to another one
POLICY = "; ".join(
    [
        "default-src 'self'",
        "script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:",
        "style-src 'self' 'unsafe-inline'",
        "img-src 'self' data: blob:",
        "font-src 'self' data:",
        "media-src 'self' data: blob:",
        "worker-src 'self' blob:",
        "connect-src 'self' data: blob:",
        "frame-src 'self' data: blob:",
        "frame-ancestors 'self'",
        "form-action 'self'",
        "base-uri 'self'",
        "object-src 'none'",
    ]
)
HEADERS = {
    b"content-security-policy": POLICY.encode(),
    b"referrer-policy": b"same-origin",
    b"x-content-type-options": b"nosniff",
    b"x-frame-options": b"SAMEORIGIN",
    b"cross-origin-resource-policy": b"same-origin",
}

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]


class Guard:
    """An ASGI application before another one.

    Args:
        app: the one that answers what passes.
        password: of the login.
        ask: whether every request must bring the login. Without, the application asks for it itself.
    """

    def __init__(self, app: App, password: str, ask: bool) -> None:
        self.app, self.password, self.ask = app, password, ask

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Refuse the request, or hand it on."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = [(name.lower(), value.decode("latin-1")) for name, value in scope["headers"]]
        if (reason := foreign(headers, scope["type"] == "http" and scope["method"] in ("GET", "HEAD"))) is not None:
            await refuse(scope, receive, send, 403, reason)
        elif scope["type"] == "http" and scope["path"] == ALIVE:
            nonce = parse_qs(scope["query_string"].decode("latin-1")).get("nonce", [""])[0]
            await reply(send, 200, proof(self.password, nonce))
        elif self.ask and not allowed(headers, self.password):
            where = f"behind the colon in the file .servers/{login.NAME} of the workspace"
            await refuse(scope, receive, send, 401, f"user {login.USER}, password {where}")
        else:
            await self.app(scope, receive, with_headers(send))


def foreign(
    headers: list[tuple[bytes, str]], reads: bool, own: re.Pattern[str] = OWN_HOST, scheme: str = "http"
) -> str | None:
    """Why a request is not one of this server's own pages or of a program; None when it is.

    Args:
        headers: the request's, names in small letters.
        reads: whether it only reads.
        own: names of this server, with the port where it is not the scheme's.
        scheme: of its pages.
    """
    given: dict[bytes, list[str]] = {}
    for name, value in headers:
        given.setdefault(name, []).append(value)
    hosts = given.get(b"host", [])
    if len(hosts) != 1 or not own.fullmatch(hosts[0]):
        return "unknown host"
    if any(origin != f"{scheme}://{hosts[0]}" for origin in given.get(b"origin", [])):
        return "a page of another origin"
    links = reads and given.get(b"sec-fetch-mode") == ["navigate"]  # a link to a page may stand anywhere
    if not links and set(given.get(b"sec-fetch-site", [])) & {"cross-site", "same-site"}:
        return "a page of another origin"
    return None


def allowed(headers: list[tuple[bytes, str]], password: str) -> bool:
    """Whether the request brings the login."""
    given = [value for name, value in headers if name == b"authorization"]
    if len(given) != 1:
        return False
    scheme, _, rest = given[0].partition(" ")
    wanted = login.header(password).partition(" ")[2]
    return scheme.lower() == "basic" and hmac.compare_digest(rest.strip().encode(), wanted.encode())


def proof(password: str, nonce: str) -> str:
    """Proof that only somebody who knows the password can give to `nonce`; it does not tell the password."""
    return hmac.new(password.encode(), f"alive {nonce}".encode(), hashlib.sha256).hexdigest()


async def refuse(scope: Message, receive: Receive, send: Send, status: int, reason: str) -> None:
    """Answer no; a WebSocket is closed before it opens."""
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": reason})
        return
    await reply(send, status, reason)


async def reply(send: Send, status: int, text: str) -> None:
    """A short answer in plain text, or in JSON; of a 401 the text is the realm too, which some browsers show."""
    kind = b"application/json" if text.startswith("{") else b"text/plain; charset=utf-8"
    headers = {**HEADERS, b"content-type": kind, b"cache-control": b"no-store"}
    if status == 401:
        headers[b"www-authenticate"] = f'Basic realm="{text}", charset="UTF-8"'.encode()
    await send({"type": "http.response.start", "status": status, "headers": list(headers.items())})
    await send({"type": "http.response.body", "body": text.encode() + b"\n"})


def with_headers(send: Send) -> Send:
    """Send the application's answer with the headers that every page gets."""

    async def wrapped(message: Message) -> None:
        if message["type"] == "http.response.start":
            kept = [
                (name, value)
                for name, value in message.get("headers", [])
                if name.lower() not in HEADERS and not name.lower().startswith(b"access-control-")
            ]
            message = {**message, "headers": [*kept, *HEADERS.items()]}
        await send(message)

    return wrapped
