"""Serves the operator's page: `python -m flows.servers.operator_server --workspace FOLDER --console N --port P`.

A process of its own beside `bumblebee deploy run`, which starts it: it gets what the console knows by an inherited
socket, and can send back one word, stop. It is on loopback alone, behind the guard and the login of the workspace's
other pages, works at low priority, and ends when the console is gone.
"""

import argparse
import asyncio
import json
import os
import select
import signal
import socket
import sys
import threading
import time
from pathlib import Path
from typing import Any

from bumblebee.errors import EXIT_BAD_INPUT, BadInput
from bumblebee.io.read import read_text
from bumblebee.view.operator_page import STOP_PATH, live_page
from bumblebee.wire.links import packets
from bumblebee.wire.operator.watcher import STOP
from flows.environment import SERVERS
from flows.people import login
from flows.people.guard import Guard
from flows.servers.front import serve
from flows.servers.servers import listener

_NICE = 10  # the guard, on the same cores, comes first


class Shown:
    """Newest of what the console has said.

    Args:
        console: packets to and from it.
    """

    def __init__(self, console: socket.socket) -> None:
        self._console, self._at = console, time.monotonic()
        self._run: dict[str, Any] = {}
        self._facts: dict[str, Any] | None = None
        self._after: Path | None = None

    def take(self) -> None:
        """Take what has come.

        Raises:
            Gone: the console has ended.
        """
        for message in packets.received(self._console):
            said = json.loads(message)
            if "run" in said:
                self._run |= said["run"]
            elif "after" in said:
                self._after = Path(said["after"])
            else:
                self._facts, self._at = said, time.monotonic()

    def stop(self) -> None:
        """Ask the console to stop."""
        packets.send(self._console, STOP)

    def page(self) -> str:
        """The page now: live, or that of the run that has ended."""
        if self._after is not None:
            return read_text(self._after)
        return live_page(self._run, self._facts, time.monotonic() - self._at)


class OperatorPage:
    """An ASGI application with one page to look at and one place to send a stop to.

    Args:
        shown: what it shows.
    """

    def __init__(self, shown: Shown) -> None:
        self._shown = shown

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            return
        status, headers, body = await asyncio.to_thread(self.answer, scope["method"], scope["path"])
        await send({"type": "http.response.start", "status": status, "headers": headers})
        await send({"type": "http.response.body", "body": body})

    def answer(self, method: str, path: str) -> tuple[int, list[tuple[bytes, bytes]], bytes]:
        """Status, headers and body for a request that has passed the guard."""
        kind = [(b"cache-control", b"no-store"), (b"content-type", b"text/html; charset=utf-8")]
        if method == "POST" and path == STOP_PATH:
            try:
                self._shown.stop()
            except packets.Gone:
                return 410, kind, b"the run is over"
            return 303, [(b"location", b"/")], b""
        if method in ("GET", "HEAD") and path == "/":
            return 200, kind, self._shown.page().encode()
        return 404, kind, b"no such page"


def main(argv: list[str] | None = None) -> int:
    """Serve until the console is gone."""
    parser = argparse.ArgumentParser(prog="python -m flows.servers.operator_server", description=__doc__)
    parser.add_argument("--workspace", type=Path, required=True)
    parser.add_argument("--console", type=int, required=True, help="number of the inherited socket")
    parser.add_argument("--port", type=int, required=True, help="0 for a free one")
    options = parser.parse_args(argv)
    os.nice(_NICE)
    os.umask(0o077)
    console = socket.socket(fileno=options.console)
    console.setblocking(False)
    try:
        password = login.ensure(login.private(options.workspace / SERVERS))
        bound = listener(options.port)
    except (BadInput, OSError) as error:
        print(error, file=sys.stderr)
        return EXIT_BAD_INPUT
    shown = Shown(console)
    threading.Thread(target=_attend, args=(console, shown), daemon=True).start()
    print(f"http://127.0.0.1:{bound.getsockname()[1]}", flush=True)
    serve(Guard(OperatorPage(shown), password, ask=True), bound)
    return 0


def _attend(console: socket.socket, shown: Shown) -> None:
    try:
        while True:
            select.select([console], [], [])
            shown.take()
    except packets.Gone:
        os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    raise SystemExit(main())
