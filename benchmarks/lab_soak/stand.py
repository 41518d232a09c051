"""A lab on this machine whose parts can be taken away: PostgreSQL, S3, a Ray head and workers, small disks."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil

from tests.lab import cluster as clusters
from tests.lab import machines

WORKERS = 2
DISK = "700m"  # of each worker and of the workspaces


@dataclass
class Stand:
    """Processes that run, and how to hit them."""

    folder: Path
    postgres: machines.Postgres
    store: machines.Store
    seaweed: "Server"
    address: str
    """Address of Ray's head."""
    workers: list[clusters.Node]

    @property
    def loops(self) -> Path:
        """Folder of the workspaces, a disk of its own."""
        return self.folder / "loops"

    def content(self, remote: Path) -> dict[str, Any]:
        """Content of lab.yaml."""
        mlflow = {"database": self.postgres.url("mlflow"), "artifacts": f"s3://{self.store.bucket}/mlflow"}
        return {
            "prefect": {"database": self.postgres.url("prefect")},
            "mlflow": {**mlflow, "s3_endpoint": self.store.endpoint},
            "ray": {"address": self.address, "remote": str(remote)},
        }

    def kill_worker(self, number: int) -> None:
        """As when its power goes."""
        self.workers[number].kill()

    def start_worker(self, number: int) -> None:
        """Start the machine again, with its folder as it was left."""
        self.workers[number] = worker(self.folder / f"worker{number}", self.address)


@dataclass
class Server:
    """SeaweedFS, which can be ended, frozen and started again as it was."""

    command: list[str]
    folder: Path
    process: psutil.Process | subprocess.Popen[bytes]

    def kill(self) -> None:
        """By SIGKILL."""
        self.process.kill()
        self.process.wait()

    def start(self) -> None:
        """Again."""
        with (self.folder / "log").open("ab") as log:
            self.process = subprocess.Popen(self.command, stdout=log, stderr=log, start_new_session=True)

    def freeze(self) -> None:
        """It takes connections and answers nothing."""
        self.process.send_signal(signal.SIGSTOP)

    def thaw(self) -> None:
        """It goes on."""
        self.process.send_signal(signal.SIGCONT)


@contextmanager
def stand(folder: Path) -> Iterator[Stand]:
    """Start everything; it is ended with the block, and the disks are given back.

    Args:
        folder: a new one with a short name, since sockets lie in it; needs root for the disks.
    """
    password, secret = machines.new_secret(), machines.new_secret()
    with ExitStack() as stack:
        folder.mkdir(mode=0o755, parents=True)
        for name in ("loops", *(f"worker{number}" for number in range(WORKERS))):
            stack.enter_context(disk(folder / name))
        (folder / "dvc").mkdir()
        secrets(folder, password, secret)
        postgres = stack.enter_context(machines.postgres(folder / "pg", password))
        store = stack.enter_context(machines.s3(folder / "s3", "lab", secret))
        seaweed = found_seaweed(folder / "s3")
        address, head = start_head(folder)
        stack.callback(head.kill)
        made = Stand(folder, postgres, store, seaweed, address, [])
        stack.callback(lambda: (seaweed.thaw(), seaweed.process.kill()))
        for number in range(WORKERS):
            made.workers.append(worker(folder / f"worker{number}", address))
            # One after the other: two that start at once on one machine get into each other's way.
            until(lambda: clusters._answers(address, len(made.workers) + 1))
        stack.callback(lambda: [each.kill() for each in made.workers])
        yield made


@contextmanager
def disk(folder: Path) -> Iterator[None]:
    """A folder on a disk of its own."""
    folder.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={DISK},mode=755", "tmpfs", str(folder)], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def fill(folder: Path) -> None:
    """Leave no byte on the folder's disk."""
    handle, size = os.open(folder / ".filler", os.O_WRONLY | os.O_CREAT), 1 << 20
    while size:
        try:
            os.write(handle, bytes(size))
        except OSError:
            size //= 2
    os.close(handle)


def empty(folder: Path) -> None:
    """Give the bytes back."""
    (folder / ".filler").unlink(missing_ok=True)


def secrets(folder: Path, password: str, secret: str) -> None:
    """The files in which clients look for them, and the variables that name these files."""
    texts = {
        "PGPASSFILE": f"*:*:*:{machines.USER}:{password}\n",
        "AWS_SHARED_CREDENTIALS_FILE": f"[default]\naws_access_key_id = lab\naws_secret_access_key = {secret}\n",
    }
    for name, text in texts.items():
        file = folder / name.lower()
        file.write_text(text)
        file.chmod(0o600)
        os.environ[name] = str(file)
    clusters.new_token(folder / "token")
    os.environ |= {"RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN_PATH": str(folder / "token")}


def found_seaweed(folder: Path) -> Server:
    """The server that `machines.s3` has started in this folder."""
    for child in psutil.Process().children():
        with suppress(psutil.Error):
            if f"-dir={folder}" in child.cmdline():
                return Server(child.cmdline(), folder, child)
    raise RuntimeError("no SeaweedFS among the children of this process")


def start_head(folder: Path) -> tuple[str, clusters.Node]:
    """Ray's head, without CPU slots."""
    own = clusters.port()
    address = f"{machines.HOST}:{own}"
    words = ["--head", f"--port={own}", "--num-cpus=0", "--include-dashboard=false", f"--temp-dir={folder}/ray"]
    node = ray_start(folder / "head", words)
    until(lambda: clusters._answers(address, 1))
    return address, node


def worker(folder: Path, address: str) -> clusters.Node:
    """One with a slot; it need not have joined yet."""
    return ray_start(folder, [f"--address={address}", "--num-cpus=1"])


def ray_start(folder: Path, words: list[str]) -> clusters.Node:
    """`ray start` in the folder, which may have the work of an earlier one."""
    folder.mkdir(exist_ok=True)
    command = [sys.executable, "-m", "ray.scripts.scripts", "start", *words, f"--node-ip-address={machines.HOST}"]
    command += ["--block", f"--object-store-memory={100 * 2**20}", "--num-gpus=0", "--disable-usage-stats"]
    log = folder.parent / f"{folder.name}.log"  # not on the disk that is filled
    with log.open("ab") as said:
        process = subprocess.Popen(
            command,
            cwd=folder.parent,
            env={**os.environ, "BUMBLEBEE_NODE": str(folder), **clusters.PATIENT},
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=said,
            start_new_session=True,
        )
    return clusters.Node(process, folder)


def until(done: Callable[[], bool]) -> None:
    """Wait for what must come soon."""
    end = time.monotonic() + clusters.START
    while not done():
        if time.monotonic() > end:
            raise RuntimeError(f"Ray did not start within {clusters.START:g} s; see its log")
        time.sleep(0.5)


def clear(folder: Path) -> None:
    """Remove a folder, also one in which something that was killed has just been writing."""
    for _ in range(5):
        with contextlib.suppress(OSError):
            shutil.rmtree(folder)
        if not folder.exists():
            return
        time.sleep(1)
