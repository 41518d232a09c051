"""A Ray cluster on this machine: a head without CPU slots and workers, each with a folder of its own and a token."""

import os
import secrets
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import psutil

from tests.lab.machines import HOST, free_port

START = 90.0  # [s]
PATIENT = {"RAY_raylet_start_wait_time_s": "90"}  # a machine with two busy cores is slow to start
TAKEN = range(10002, 20000)  # ports that Ray gives to its own worker processes


def port() -> int:
    """A free one outside those of Ray's worker processes."""
    while (found := free_port()) in TAKEN:
        pass
    return found


@dataclass(frozen=True)
class Node:
    """One machine of the cluster."""

    process: subprocess.Popen[bytes]
    folder: Path

    def kill(self) -> None:
        """End everything of it by SIGKILL, as when its power goes."""
        if self.process.poll() is None:
            root = psutil.Process(self.process.pid)
            for each in [root, *root.children(recursive=True)]:
                with suppress(psutil.Error):
                    each.kill()
            self.process.wait()


@dataclass(frozen=True)
class Cluster:
    """A standing cluster."""

    address: str
    folder: Path
    workers: tuple[Node, ...]


@contextmanager
def cluster(folder: Path, workers: int) -> Iterator[Cluster]:
    """Start a head and workers with one CPU slot each; everything is ended with the block.

    Args:
        folder: short, since sockets lie in it.
        workers: their number.
    """
    own, nodes = port(), []
    try:
        head = ["--head", f"--port={own}", "--num-cpus=0", "--include-dashboard=false", f"--temp-dir={folder}/ray"]
        nodes.append(_start(folder / "head", head))
        _until(lambda: _answers(f"{HOST}:{own}", 1), nodes)
        for number in range(workers):
            words = [f"--address={HOST}:{own}", "--num-cpus=1"]
            nodes.append(_start(folder / f"worker{number}", words))
            # One after the other: two that start at once on one machine get into each other's way.
            _until(lambda: _answers(f"{HOST}:{own}", len(nodes)), nodes)
        yield Cluster(f"{HOST}:{own}", folder, tuple(nodes[1:]))
    finally:
        for node in reversed(nodes):
            node.kill()


def new_token(path: Path) -> None:
    """Write a token as Ray reads it."""
    path.write_text(secrets.token_hex(32))
    path.chmod(0o600)


def _start(folder: Path, words: list[str]) -> Node:
    folder.mkdir(parents=True)
    command = [sys.executable, "-m", "ray.scripts.scripts", "start", *words, f"--node-ip-address={HOST}", "--block"]
    memory = [f"--memory={2 * 2**30}", f"--object-store-memory={200 * 2**20}", "--num-gpus=0", "--disable-usage-stats"]
    with (folder / "log").open("wb") as log:
        process = subprocess.Popen(
            [*command, *memory],
            cwd=folder,
            env={**os.environ, "BUMBLEBEE_NODE": str(folder), **PATIENT},
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )
    return Node(process, folder)


COUNT = """
import sys, ray
ray.init(address=sys.argv[1], log_to_driver=False, logging_level="ERROR")
sys.exit(sum(node["Alive"] for node in ray.nodes()) != int(sys.argv[2]))
"""


def _answers(address: str, nodes: int) -> bool:
    command = [sys.executable, "-c", COUNT, address, str(nodes)]
    asked = subprocess.run(command, capture_output=True, check=False, timeout=60)
    return asked.returncode == 0


def _until(done: Callable[[], bool], nodes: list[Node]) -> None:
    end = time.monotonic() + START
    while not done():
        ended = [node for node in nodes if node.process.poll() is not None]
        if ended or time.monotonic() > end:
            said = "\n".join((node.folder / "log").read_text(errors="replace")[-1500:] for node in ended or nodes)
            raise RuntimeError(f"Ray did not start: {said}")
        time.sleep(0.5)
