"""The servers of Prefect and MLflow: SQLite files under .servers/ or a lab's databases, a login, on this machine alone.

With a door people of other machines get in, too (`flows/people/door.py`). One process keeps the servers: it holds a
lock on .servers, and they end with it, also when it is killed. A second one uses them and leaves them alone.
"""

import fcntl
import json
import os
import secrets
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from itertools import chain
from pathlib import Path
from typing import IO

from bumblebee.errors import BadInput
from flows import runs
from flows.environment import SERVERS, environment
from flows.people import accounts as people
from flows.people import login
from flows.people.guard import ALIVE, proof
from flows.processes import alive, born, same, stop
from tasks.lab.checks import check_lab
from tasks.lab.serve import ServeLab, tls
from tasks.lab.servers import FILE, read_lab

__all__ = ["Addresses", "alive", "running", "servers", "stop"]

HOST = "127.0.0.1"
HOME = Path(__file__).resolve().parents[2]
START_LIMIT = 120.0  # [s] until a server must answer; a cold first start with two busy cores takes about 30
NAMES = ("prefect", "mlflow")
FRONT = [sys.executable, "-m", "flows.servers.front"]


@dataclass(frozen=True)
class Addresses:
    """Where the two servers answer."""

    prefect: str
    """Address of Prefect's pages; its interface is below `/api`."""
    mlflow: str
    """Address of MLflow's pages and interface."""
    keeper: int
    """The process that started them and ends them."""
    pids: tuple[int, ...]
    """The servers' own processes, Prefect's first."""
    born: tuple[float, ...] = ()
    """When these started, and at the end the keeper: seconds since 1970."""
    door: tuple[str, ...] = ()
    """Addresses of both for people from elsewhere, where `lab.yaml` has a section `serve`."""

    def lost(self) -> list[str]:
        """The servers whose process is gone."""
        return [name for name, pid, when in zip(NAMES, self.pids, self.born, strict=False) if not same(pid, when)]


def require_port(name: str, port: int) -> None:
    """Refuse what is no port that a user may listen on; 0 asks for a free one.

    Raises:
        BadInput: for anything but 0 and 1024 to 65535.
    """
    if port != 0 and not 1024 <= port <= 65535:
        raise BadInput(name, "0 (any free port) or a port from 1024 to 65535", str(port))


def listener(wanted: int = 0, host: str = HOST) -> socket.socket:
    """A socket that is bound to the port, or to a free one; nobody else can take it any more.

    Raises:
        BadInput: when the wanted port is taken, or the address is none of this machine's.
    """
    bound = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        bound.bind((host, wanted))
        if wanted:  # with SO_REUSEADDR a port that somebody listens on can be refused only here
            bound.listen()
    except OSError as error:
        bound.close()
        remedy = "Give another port, or none for a free one."
        raise BadInput(f"port {wanted} of {host}", "a free port", str(error.strerror), remedy) from None
    return bound


def running(workspace: Path) -> Addresses | None:
    """The servers that another process keeps for this workspace, if they answer, and are what they say they are."""
    found = written(workspace)
    password = login.read(workspace / SERVERS)
    if found is None or password is None:
        return None
    return found if answers(found.prefect, password) and answers(found.mlflow, password) else None


def written(workspace: Path) -> Addresses | None:
    """Addresses that the last keeper wrote down."""
    try:
        table = json.loads((workspace / SERVERS / "addresses.json").read_text())
        return Addresses(**{**table, **{name: tuple(table.get(name, ())) for name in ("pids", "born", "door")}})
    except (OSError, ValueError, TypeError, KeyError):
        return None


def answers(url: str, password: str) -> bool:
    """Whether a server of ours answers there: one that knows the password, and not who took the port after it."""
    nonce = secrets.token_hex(16)
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    try:
        with opener.open(f"{url}{ALIVE}?nonce={nonce}", timeout=5) as reply:
            said = reply.read(200).decode("ascii", "replace").strip()
            return secrets.compare_digest(said, proof(password, nonce))
    except (urllib.error.URLError, OSError, ValueError):
        return False


@contextmanager
def servers(
    workspace: Path, prefect_port: int = 0, mlflow_port: int = 0, door: ServeLab | None = None
) -> Iterator[Addresses]:
    """Both servers for the length of a block.

    Those that another process keeps for this workspace are used and left to it.

    Args:
        workspace: its folder.
        prefect_port: of Prefect's server on loopback; 0 for a free one.
        mlflow_port: of MLflow's.
        door: how people from elsewhere get in; None: they do not.

    Raises:
        BadInput: when a wanted port is taken or none, others are in use, a server ends at once, or there is a door and
            nobody with a login of their own.
    """
    require_port("--prefect-port", prefect_port)
    require_port("--mlflow-port", mlflow_port)
    workspace = workspace.resolve()
    folder = login.private(workspace / SERVERS)
    if door is not None and door.certificate:
        tls(door, f"{workspace / FILE}: serve")
    if door is not None and not people.read(folder):
        do = "Add each person, yourself too: `bumblebee lab user add NAME`."
        raise BadInput(folder / people.FILE, "personal logins, before servers listen for people", "none", do)
    with (folder / "lock").open("a+") as lock:
        found = _lock_or_running(workspace, lock)
        if found is not None:
            _require_ports(found, prefect_port, mlflow_port)
            if door is not None and found.door != tuple(door.addresses.values()):
                came = f"those of process {found.keeper}, which do not"
                raise BadInput(workspace, f"servers that answer at {door.prefect}", came, "End it, then start again.")
            yield found
            return
        with _kept(workspace, {"prefect": prefect_port, "mlflow": mlflow_port}, door) as made:
            yield made


def _lock_or_running(workspace: Path, lock: IO[str]) -> Addresses | None:
    """Become the keeper (None), or wait for the servers of the one that is."""
    end = time.monotonic() + START_LIMIT
    while True:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if (found := running(workspace)) is not None:
                return found
            if time.monotonic() > end:
                lock.seek(0)
                came = f"process {lock.read(20).strip() or '?'}, which holds them and does not answer"
                raise BadInput(workspace / SERVERS, "servers that answer", came, "End it, then start again.") from None
            time.sleep(0.2)
            continue
        lock.seek(0)
        lock.truncate()
        lock.write(f"{os.getpid()}\n")
        lock.flush()
        return None


def _require_ports(found: Addresses, prefect_port: int, mlflow_port: int) -> None:
    for name, wanted, address in (("prefect", prefect_port, found.prefect), ("mlflow", mlflow_port, found.mlflow)):
        if wanted and not address.endswith(f":{wanted}"):
            came = f"{wanted}, while this workspace's servers already run (Prefect {found.prefect}, MLflow "
            came += f"{found.mlflow}, kept by process {found.keeper})"
            remedy = f"Open those, or end process {found.keeper} first."
            raise BadInput(f"--{name}-port", f"no port, or {address.rpartition(':')[2]}", came, remedy)


@contextmanager
def _kept(workspace: Path, ports: dict[str, int], door: ServeLab | None) -> Iterator[Addresses]:
    """Start both servers, and end them with the block. The lock is held."""
    folder, lab = workspace / SERVERS, read_lab(workspace)
    if lab is not None:
        check_lab(lab, workspace)
    file = folder / "addresses.json"
    _end_left_over(workspace)
    file.unlink(missing_ok=True)
    password = login.ensure(folder)
    login.private(folder / "artifacts")
    started: dict[str, subprocess.Popen[bytes]] = {}
    listeners: dict[str, list[socket.socket]] = {}
    try:
        for name in NAMES:
            listeners[name] = [listener(ports[name])]
            if door is not None:
                host, port = door.places[name]
                listeners[name].append(listener(port, host))
        urls = {name: f"http://{HOST}:{each[0].getsockname()[1]}" for name, each in listeners.items()}
        for name in NAMES:
            started[name] = _start(name, listeners[name], workspace)
            for each in listeners[name]:
                each.close()
        pids = tuple(each.pid for each in started.values())
        times = tuple(born(pid) for pid in (*pids, os.getpid()))
        public = () if door is None else tuple(door.addresses.values())
        addresses = Addresses(**urls, keeper=os.getpid(), pids=pids, born=times, door=public)
        for name in NAMES:
            _wait(started[name], urls[name], password, folder / f"{name}.log")
        runs.clear_lost(folder, addresses.prefect, password, shared=lab is not None)
        login.write_private(file, json.dumps(asdict(addresses)))
        yield addresses
    finally:
        for each in chain(*listeners.values()):
            each.close()
        file.unlink(missing_ok=True)  # ours: the lock is held from before it was written until after this
        stop([each.pid for each in started.values()])


def _end_left_over(workspace: Path) -> None:
    """End the servers of a keeper that was killed; they end by themselves, but not at once."""
    old = written(workspace)
    if old is not None:
        stop([pid for pid, when in zip(old.pids, old.born, strict=False) if same(pid, when)])


def _start(name: str, bound: list[socket.socket], workspace: Path) -> subprocess.Popen[bytes]:
    """Start one server on its sockets, the loopback's first."""
    command = [*FRONT, name, "--workspace", str(workspace)]
    for option, each in zip(("--socket", "--door"), bound, strict=False):
        command += [option, str(each.fileno())]
    command += ["--keeper", str(os.getpid())]
    settings = {key: value for key, value in environment(workspace).items() if key not in ADDRESSES}
    path = workspace / SERVERS / f"{name}.log"
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW, 0o600), "ab") as log:
        # A session of its own: Ctrl-C reaches the keeper first, which then ends the servers in order.
        return subprocess.Popen(
            command,
            cwd=HOME,
            env=settings,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
            pass_fds=tuple(each.fileno() for each in bound),
        )


ADDRESSES = {"PREFECT_API_URL", "MLFLOW_TRACKING_URI", "MLFLOW_REGISTRY_URI"}  # of clients; a server asks nobody


def _wait(process: subprocess.Popen[bytes], url: str, password: str, log: Path) -> None:
    end = time.monotonic() + START_LIMIT
    while not answers(url, password):
        if process.poll() is not None or time.monotonic() > end:
            lines = [line for line in log.read_text(errors="replace").splitlines() if line.strip()] or ["no message"]
            raise BadInput(url, "a server that answers", lines[-1], f"See {log}.")
        with suppress(subprocess.TimeoutExpired):
            process.wait(0.1)
