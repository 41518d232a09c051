"""Plain `mlflow server` and `prefect server start` on a lab's databases and store, without login."""

import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from flows.environment import environment
from flows.processes import end_tree
from tasks.lab.servers import read_lab
from tests.lab.machines import HOST, free_port

START = 180.0  # [s]


@contextmanager
def mlflow(workspace: Path, workers: int) -> Iterator[str]:
    """MLflow's address for the length of a block.

    Args:
        workspace: whose lab.yaml names database and store.
        workers: processes of the server.
    """
    lab, port = read_lab(workspace), free_port()
    assert lab is not None
    command = ["mlflow", "server", "--backend-store-uri", lab.mlflow.connection, "--host", HOST, "--port", str(port)]
    command += ["--artifacts-destination", lab.mlflow.artifacts, "--workers", str(workers)]
    with served(command, workspace, f"http://{HOST}:{port}", "health", f"mlflow-{workers}"):
        yield f"http://{HOST}:{port}"


@contextmanager
def prefect(workspace: Path) -> Iterator[str]:
    """Serve Prefect plainly."""
    port = free_port()
    command = ["prefect", "server", "start", "--host", HOST, "--port", str(port)]
    with served(command, workspace, f"http://{HOST}:{port}", "api/health", "prefect"):
        yield f"http://{HOST}:{port}"


@contextmanager
def served(command: list[str], workspace: Path, address: str, health: str, name: str) -> Iterator[None]:
    """The program until the block ends; what it says is in a file of the workspace."""
    settings = {key: value for key, value in environment(workspace).items() if "AUTH_STRING" not in key}
    settings |= {"PREFECT_HOME": str(workspace / "plain"), "PREFECT_PROFILES_PATH": str(workspace / "plain.toml")}
    words = [str(Path(sys.executable).parent / command[0]), *command[1:]]
    with (workspace / f"plain-{name}.log").open("wb") as log:
        process = subprocess.Popen(words, cwd=workspace, env=settings, stdout=log, stderr=log)
    try:
        wait(f"{address}/{health}", process)
        yield
    finally:
        end_tree(process.pid)


def wait(address: str, process: "subprocess.Popen[bytes]") -> None:
    """Until it answers."""
    end = time.monotonic() + START
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    while time.monotonic() < end and process.poll() is None:
        try:
            with opener.open(address, timeout=5) as reply:
                if reply.status == 200:
                    return
        except (urllib.error.URLError, OSError):
            time.sleep(0.5)
    raise RuntimeError(f"no answer from {address}; status {process.poll()}")
