"""The environment that every process of the loop gets: this Python first, no telemetry, everything in the workspace."""

import os
import sys
from pathlib import Path

from bumblebee.robot.which import VARIABLE
from flows.people import login
from tasks.lab.private import INDEX
from tasks.lab.servers import read_lab

SERVERS = ".servers"  # folder of the workspace with both servers' databases, logs and addresses

QUIET = {
    "DO_NOT_TRACK": "true",
    "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "MLFLOW_SERVER_ENABLE_JOB_EXECUTION": "false",  # seven processes for a feature that nothing here uses
    "DVC_NO_ANALYTICS": "1",
    "HF_HUB_OFFLINE": "1",
    "HF_HUB_DISABLE_TELEMETRY": "1",
}
SECRETS = ("PREFECT_API_AUTH_STRING", "PREFECT_SERVER_API_AUTH_STRING")
HERE = ("127.0.0.1", "localhost")  # never through a proxy, which would see the login
# One BLAS thread a process: several would fight torch and the simulator for the same cores.
THREADS = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def environment(workspace: Path) -> dict[str, str]:
    """The variables of a process that works in `workspace`, built on those of this process.

    With the login to the workspace's servers, where there is one; see `without_login`.
    """
    workspace = workspace.resolve()
    servers = workspace / SERVERS
    found = without_login(dict(os.environ))
    password = login.read(servers)
    if password is not None:
        found["PREFECT_API_AUTH_STRING"] = login.pair(password)
    found |= QUIET
    if (lab := read_lab(workspace)) is not None:
        found |= lab.variables
    for name in ("NO_PROXY", "no_proxy"):
        known = [host for host in found.get(name, "").split(",") if host and host not in HERE]
        found[name] = ",".join([*known, *HERE])
    for name, value in THREADS.items():
        found.setdefault(name, value)
    found["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), found.get("PATH", os.defpath)])
    found["PREFECT_HOME"] = str(servers / "prefect")
    found["PREFECT_PROFILES_PATH"] = str(servers / "prefect" / "profiles.toml")
    found["PREFECT_SERVER_ALLOW_EPHEMERAL_MODE"] = "false"
    found["PREFECT_LOGGING_TO_API_WHEN_MISSING_FLOW"] = "ignore"
    found["PREFECT_RESULTS_PERSIST_BY_DEFAULT"] = "false"
    # Without it DVC keeps its indices in a folder of the machine, shared by all users.
    found["DVC_SITE_CACHE_DIR"] = str(workspace / INDEX)
    found["PYTHONUNBUFFERED"] = "1"
    found["SHELL"] = "/bin/sh"  # DVC runs commands in it; a login shell's settings have no place in a stage
    for level in ("TASK", "FLOW"):
        name = f"%({level.lower()}_run_name)s"
        found[f"PREFECT_LOGGING_FORMATTERS_STANDARD_{level}_RUN_FMT"] = f"%(asctime)s {name} | %(message)s"
    found.pop("PYTHONPATH", None)
    found.pop(VARIABLE, None)  # the workspace says which robot (tasks/__init__.py)
    found.pop("DVC_STAGE", None)
    found.pop("DVC_ROOT", None)
    return found


def without_login(variables: dict[str, str]) -> dict[str, str]:
    """The variables for a process that has nothing to do with the servers, such as a stage."""
    return {name: value for name, value in variables.items() if name not in SECRETS}
