"""The process of the flow when Prefect itself fails: one line, and never its traceback."""

import errno
import logging
import os
import subprocess
import sys
from pathlib import Path
from uuid import uuid4

import pytest
from prefect.client.schemas import FlowRun
from prefect.logging.loggers import flow_run_logger

from flows import loop as loops
from flows.environment import SERVERS, environment
from flows.servers.servers import HOME, listener
from flows.walk import without_server, without_trace


def test_a_server_that_is_gone_before_the_run_begins_is_one_line(tmp_path: Path) -> None:
    (tmp_path / SERVERS).mkdir()
    with listener() as bound:  # nobody listens on it
        settings = environment(tmp_path) | {"PREFECT_API_URL": f"http://127.0.0.1:{bound.getsockname()[1]}/api"}
        settings |= {"BUMBLEBEE_WORKSPACE": str(tmp_path), "PATH": os.environ["PATH"]}
        command = [sys.executable, "-m", "flows.walk"]
        ended = subprocess.run(
            command, cwd=HOME, env=settings, capture_output=True, text=True, check=False, timeout=120
        )
    assert ended.returncode == 1
    assert ended.stderr.splitlines() == [without_server(RuntimeError(), True)]


def test_a_server_without_its_database_is_one_line_and_no_traceback(caplog: pytest.LogCaptureFixture) -> None:
    error = RuntimeError(
        "Server error '500 Internal Server Error' for url 'http://127.0.0.1:1/api/flow_runs/x/set_state'"
    )
    assert without_server(error, False).startswith("Prefect's server could not keep how the run began or ended")

    run = FlowRun(id=uuid4(), flow_id=uuid4(), name="x")
    assert flow_run_logger(run).logger is logging.getLogger("prefect.flow_runs")  # which `walk` filters

    class PrefectHTTPStatusError(Exception):
        """As Prefect calls it."""

    log = logging.getLogger("test.flow_runs")
    log.addFilter(without_trace)
    for kind, shown in ((PrefectHTTPStatusError, False), (KeyError, True)):
        caplog.clear()
        try:
            raise kind("x")
        except Exception:
            log.exception("Encountered exception during execution")
        assert ("Traceback" in caplog.text) is shown


def test_a_full_disk_as_the_run_begins_is_the_disks_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ended = []

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(tmp_path / "runs"))

    monkeypatch.setenv("BUMBLEBEE_WORKSPACE", str(tmp_path))
    monkeypatch.setattr(loops, "require_own", lambda folder: None)
    monkeypatch.setattr(loops, "recorded", full)
    monkeypatch.setattr(loops, "at_end", ended.append)
    state = loops.loop.fn()
    assert state.is_failed() and ended == [state]
    assert state.message.startswith(f"{tmp_path / 'runs'}: expected a disk that takes the output, came no space left")
    monkeypatch.setattr(loops, "recorded", lambda *_: {}["flow"])
    with pytest.raises(KeyError):
        loops.loop.fn()


def test_an_error_of_prefects_that_nobody_foresaw_names_a_log() -> None:
    line = without_server(KeyError("flow"), False)
    assert "\n" not in line and "KeyError: 'flow'" in line and ".log; what completed is kept" in line
