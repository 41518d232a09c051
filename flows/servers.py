"""The servers of Prefect and MLflow on this machine alone: SQLite files under .servers/, free ports, a clean end."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from bumblebee.errors import BadInput
from flows.environment import SERVERS, environment

HOST = "127.0.0.1"
START_LIMIT = 120.0  # [s] until a server must answer; a cold first start with two busy cores takes about 30
STOP_LIMIT = 10.0  # [s] until a server that was asked to end is killed


@dataclass(frozen=True)
class Addresses:
    """Where the two servers answer."""

    prefect: str
    """Of Prefect's pages; its interface is below `/api`."""
    mlflow: str
    """Of MLflow's pages and interface."""
    keeper: int
    """The process that started them and ends them."""
    pids: tuple[int, ...]
    """The servers' own processes."""


def free_port(wanted: int = 0) -> int:
    """A port that nobody listens on; `wanted` itself when given.

    Raises:
        BadInput: when the wanted port is taken.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, wanted))
        except OSError as error:
            remedy = "Give another port, or none for a free one."
            raise BadInput(f"port {wanted} of {HOST}", "a free port", str(error.strerror), remedy) from None
        return int(probe.getsockname()[1])


def running(workspace: Path) -> Addresses | None:
    """The servers that another process keeps for this workspace, if they answer."""
    try:
        found = Addresses(**json.loads((workspace / SERVERS / "addresses.json").read_text()))
    except (OSError, ValueError, TypeError):
        return None
    return found if answers(f"{found.prefect}/api/health") and answers(f"{found.mlflow}/health") else None


def answers(url: str) -> bool:
    """Whether the address answers with success."""
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with opener.open(url, timeout=5) as reply:
            return bool(reply.status == 200)
    except (urllib.error.URLError, OSError):
        return False


@contextmanager
def servers(workspace: Path, prefect_port: int = 0, mlflow_port: int = 0) -> Iterator[Addresses]:
    """Both servers for the length of a block.

    Those that another process keeps for this workspace are used and left to it; those whose keeper was killed are
    taken over and ended with the block.

    Raises:
        BadInput: when a wanted port is taken or a server ends at once.
    """
    workspace = workspace.resolve()
    found = running(workspace)
    if found is not None:
        try:
            yield found
        finally:
            if not alive(found.keeper):
                (workspace / SERVERS / "addresses.json").unlink(missing_ok=True)
                stop(list(found.pids))
        return
    ports = {"prefect": free_port(prefect_port), "mlflow": free_port(mlflow_port)}
    folder = workspace / SERVERS
    (folder / "artifacts").mkdir(parents=True, exist_ok=True)
    started: dict[str, subprocess.Popen[bytes]] = {}
    try:
        for name, command in commands(workspace, ports).items():
            started[name] = _start(name, command, workspace)
        urls = {name: f"http://{HOST}:{port}" for name, port in ports.items()}
        addresses = Addresses(**urls, keeper=os.getpid(), pids=tuple(each.pid for each in started.values()))
        _wait(started["prefect"], f"{addresses.prefect}/api/health", folder / "prefect.log")
        _wait(started["mlflow"], f"{addresses.mlflow}/health", folder / "mlflow.log")
        (folder / "addresses.json").write_text(json.dumps(vars(addresses)))
        yield addresses
    finally:
        (folder / "addresses.json").unlink(missing_ok=True)
        stop([each.pid for each in started.values()])


def commands(workspace: Path, ports: dict[str, int]) -> dict[str, list[str]]:
    """The command line of each server."""
    folder = workspace / SERVERS
    prefect = [sys.executable, "-m", "prefect", "server", "start", "--host", HOST, "--port", str(ports["prefect"])]
    mlflow = [sys.executable, "-m", "mlflow", "server", "--host", HOST, "--port", str(ports["mlflow"])]
    mlflow += ["--backend-store-uri", f"sqlite:///{folder / 'mlflow.db'}", "--workers", "1"]
    mlflow += ["--serve-artifacts", "--artifacts-destination", str(folder / "artifacts")]
    return {"prefect": prefect, "mlflow": mlflow}


def _start(name: str, command: list[str], workspace: Path) -> subprocess.Popen[bytes]:
    with (workspace / SERVERS / f"{name}.log").open("ab") as log:
        # A session of its own: Ctrl-C reaches the flow first, which then ends the servers in order.
        return subprocess.Popen(
            command, cwd=workspace, env=environment(workspace), stdout=log, stderr=log, start_new_session=True
        )


def _wait(process: subprocess.Popen[bytes], url: str, log: Path) -> None:
    end = time.monotonic() + START_LIMIT
    while not answers(url):
        if process.poll() is not None or time.monotonic() > end:
            lines = [line for line in log.read_text(errors="replace").splitlines() if line.strip()] or ["no message"]
            raise BadInput(url, "a server that answers", lines[-1], f"See {log}.")
        time.sleep(0.2)


def alive(pid: int) -> bool:
    """Whether a process of this number runs."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def stop(pids: list[int]) -> None:
    """End the processes, each the head of a group, and everything that they started; first politely."""
    for pid in pids:
        _signal(pid, signal.SIGTERM)
    end = time.monotonic() + STOP_LIMIT
    while any(_running(pid) for pid in pids) and time.monotonic() < end:
        time.sleep(0.05)
    for pid in pids:
        _signal(pid, signal.SIGKILL)  # what is left of its group
        _running(pid)


def _running(pid: int) -> bool:
    try:
        return os.waitpid(pid, os.WNOHANG) == (0, 0)
    except ChildProcessError:  # another process's child, or already waited for
        return alive(pid)


def _signal(pid: int, number: int) -> None:
    with suppress(ProcessLookupError):
        os.killpg(pid, number)
