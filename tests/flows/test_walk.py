"""The process of the flow when Prefect itself fails: one line, and never its traceback."""

import os
import subprocess
import sys
from pathlib import Path

from flows.environment import SERVERS, environment
from flows.servers import HOME, listener
from flows.walk import without_server


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


def test_an_error_of_prefects_that_nobody_foresaw_names_a_log() -> None:
    line = without_server(KeyError("flow"), False)
    assert "\n" not in line and "KeyError: 'flow'" in line and ".log; what completed is kept" in line
