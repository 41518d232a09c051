"""Surroundings of all tests: no network, no telemetry, one thread, nothing of the user's own settings."""

import gc
import os
import sys

import pytest

for name, value in {
    "DO_NOT_TRACK": "true",
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
    "PREFECT_SERVER_ALLOW_EPHEMERAL_MODE": "false",
    "DVC_NO_ANALYTICS": "1",
    "HF_HUB_OFFLINE": "1",
    "BUMBLEBEE_CACHE": "",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_THREAD_LIMIT": "1",  # whatever a training asks torch for: threads that wait for each other spin meanwhile
}.items():
    os.environ[name] = value
for name in ("DVC_STAGE", "DVC_ROOT", "PREFECT_API_URL", "MLFLOW_TRACKING_URI", "PYTHONDONTWRITEBYTECODE"):
    os.environ.pop(name, None)
sys.dont_write_bytecode = False  # else every process of pytest compiles all tests anew, and every stage its modules


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The end-to-end run first: it is the longest file, and what begins last is waited for."""
    items.sort(key=lambda item: item.get_closest_marker("e2e") is None)


def pytest_collection_finish() -> None:
    """Keep the garbage collector from what was imported, which stays to the end."""
    gc.freeze()
