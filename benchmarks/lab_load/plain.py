"""Plain `mlflow server` and `prefect server start` on a lab's databases and store, without login."""

import os
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.lab_load.users import Arm
from flows.environment import environment
from flows.processes import end_tree
from tasks.lab import read_lab
from tests.lab.machines import HOST, free_port

START = 180.0  # [s]


@contextmanager
def both(workspace: Path, workers: int) -> Iterator[Arm]:
    """Both servers for the length of a block; what they say is in files of the workspace.

    Args:
        workspace: whose lab.yaml names databases and store.
        workers: processes of MLflow.
    """
    lab, ports = read_lab(workspace), (free_port(), free_port())
    assert lab is not None
    mlflow = ["mlflow", "server", "--backend-store-uri", lab.mlflow.connection, "--host", HOST, "--port", str(ports[0])]
    mlflow += ["--artifacts-destination", lab.mlflow.artifacts, "--workers", str(workers)]
    prefect = ["prefect", "server", "start", "--host", HOST, "--port", str(ports[1])]
    home = {**environment(workspace), "PREFECT_HOME": str(workspace / "plain")}
    settings = {key: value for key, value in home.items() if "AUTH_STRING" not in key and key != "PREFECT_API_URL"}
    settings.pop("PREFECT_PROFILES_PATH")
    arm = Arm("plain", f"http://{HOST}:{ports[0]}", f"http://{HOST}:{ports[1]}")
    started: list[subprocess.Popen[bytes]] = []
    try:
        for command, address in ((mlflow, f"{arm.mlflow}/health"), (prefect, f"{arm.prefect}/api/health")):
            with (workspace / f"plain-{command[0]}.log").open("wb") as log:
                words = [str(Path(sys.executable).parent / command[0]), *command[1:]]
                started.append(subprocess.Popen(words, cwd=workspace, env=settings, stdout=log, stderr=log))
            wait(address, started[-1])
        yield arm
    finally:
        for each in started:
            end_tree(each.pid)


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
    raise RuntimeError(f"no answer from {address}; status {process.poll()}, processes {os.getloadavg()}")
