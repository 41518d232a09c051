"""Two ways to one application in one process: the workspace's own on loopback, and the door for other machines."""

import asyncio
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import uvicorn

from flows.environment import SERVERS
from flows.gates.page_answer import PageAnswers
from flows.people.accounts import People
from flows.people.door import Door
from flows.people.rights import Rights
from tasks.lab.serve import ServeLab, read_serve, tls

GRACE = 2  # [s] that open connections get at the end
CONNECTIONS = 1000  # at the door at once


def with_door(
    server: str, app: Any, workspace: Path, password: str, listener: socket.socket
) -> "Callable[[uvicorn.Config], uvicorn.Server]":
    """Function that makes a server with a door, from the settings of the one without.

    Args:
        server: "prefect" or "mlflow".
        app: its application.
        workspace: whose `lab.yaml` and list of people say who gets in.
        password: of the workspace's own login.
        listener: the bound socket of the door.
    """
    own = read_serve(workspace)
    assert own is not None  # the keeper has read it
    people, rights = People(workspace / SERVERS), Rights(own.write, own.promote)
    answers = PageAnswers(workspace) if server == "prefect" else None
    door = Door(app, server, own.addresses[server], people, rights, password, answers)
    return partial(WithDoor, second=DoorServer(door, listener, own))


class DoorServer(uvicorn.Server):
    """Answers at the door; the server beside it begins and ends what both share.

    Args:
        app: what answers.
        listener: the bound socket.
        own: whose certificate is shown, where it names one.
    """

    def __init__(self, app: Any, listener: socket.socket, own: ServeLab) -> None:
        config = uvicorn.Config(
            app,
            log_level="warning",
            timeout_graceful_shutdown=GRACE,
            timeout_keep_alive=5,
            lifespan="off",
            proxy_headers=False,
            server_header=False,
            limit_concurrency=CONNECTIONS,
            ssl_context_factory=(lambda config, default: tls(own)) if own.certificate else None,
        )
        config.load()  # what is wrong with it is said before anything answers
        super().__init__(config)
        self.listener = listener

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave signals to the server beside it."""
        yield


class WithDoor(uvicorn.Server):
    """A server with a door: that opens when this one answers, and closes first."""

    def __init__(self, config: uvicorn.Config, second: DoorServer) -> None:
        super().__init__(config)
        self.second = second
        self.task: asyncio.Task[None] | None = None

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to answer."""
        await super().startup(sockets)
        if not self.should_exit:
            self.task = asyncio.create_task(self.second.serve([self.second.listener]))

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Finish what is being answered."""
        self.second.should_exit = True
        if self.task is not None:
            await self.task
        await super().shutdown(sockets)
