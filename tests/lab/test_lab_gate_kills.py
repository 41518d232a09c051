"""Prefect's server, the process that runs flows, or the database ended by SIGKILL while a gate waits: the answer counts
and the work goes on.
"""

import os
import signal
import subprocess
import sys
import time
import urllib.error
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
import pytest

from flows.environment import SERVERS
from flows.people import login
from flows.servers.servers import HOME, Addresses
from tasks.approvals import gate, ledger
from tests.flows.servers.served import LIMIT, Served
from tests.lab import machines
from tests.lab.conftest import LabOnThisMachine
from tests.lab.doors import serving, with_gate


@pytest.fixture
def folder(lab: LabOnThisMachine, tmp_path: Path) -> Path:
    """A workspace whose last stage waits at a gate."""
    return with_gate(tmp_path / f"gate-{machines.new_secret()[:6]}", lab.content(), "{mode: ask}")


def served(folder: Path, addresses: Addresses) -> Served:
    return Served(folder, addresses, login.read(folder / SERVERS) or "")


def walk_of(keeper: int) -> psutil.Process:
    """The process in which Prefect runs flows."""
    return next(one for one in psutil.Process(keeper).children() if "flows.walk" in one.cmdline())


def answer_in_a_terminal(folder: Path) -> None:
    seen = gate.request(gate.Gate(folder, 1))["seen"]["sha256"]
    words = ["gate", "approve", "1", "--workspace", str(folder), "--seen", seen, "--by", "Ada"]
    subprocess.run([sys.executable, "-m", "bumblebee", *words], cwd=HOME, check=True, timeout=LIMIT)


def of_page(folder: Path) -> dict[str, str]:
    """Fields that the page sends as an answer."""
    seen = gate.request(gate.Gate(folder, 1))["seen"]["sha256"][:12]
    return {"answer": "approve", "by": "Ada", "seen": seen, "note": ""}


def again(what: Callable[[], Any]) -> Any:
    """The first answer that is one: a connection that died costs the request that finds out."""
    end = time.monotonic() + LIMIT
    while True:
        try:
            return what()
        except (urllib.error.HTTPError, urllib.error.URLError):
            assert time.monotonic() < end
            time.sleep(0.5)


def done_once(folder: Path) -> bool:
    """Whether the stage behind the gate is made, by one answer in the record."""
    answers = ledger.check(folder / "data" / "approvals")
    return (folder / "g.txt").exists() and [one["answer"]["by"] for one in answers] == ["Ada"]


def test_prefects_server_killed_and_answered_meanwhile_the_run_goes_on_at_the_next_start(folder: Path) -> None:
    with serving(folder) as (addresses, process):
        pages = served(folder, addresses)
        run = pages.start()["id"]
        pages.until(run, "Suspended")
        os.kill(addresses.pids[0], signal.SIGKILL)
        assert process.wait(timeout=LIMIT) == 1
    answer_in_a_terminal(folder)
    with serving(folder) as (addresses, _):
        served(folder, addresses).until(run, "Completed")
    assert done_once(folder)


def test_the_process_that_runs_flows_killed_right_after_an_answer_on_the_page_the_run_goes_on_at_the_next_start(
    folder: Path,
) -> None:
    with serving(folder) as (addresses, process):
        pages = served(folder, addresses)
        run = pages.start()["id"]
        pages.until(run, "Suspended")
        walk_of(addresses.keeper).suspend()  # it cannot take up the run any more
        assert pages.resume(run, **of_page(folder))["status"] == "ACCEPT"
        walk_of(addresses.keeper).kill()
        assert process.wait(timeout=LIMIT) == 1
    with serving(folder) as (addresses, _):
        served(folder, addresses).until(run, "Completed")
    assert done_once(folder)


def test_the_database_killed_while_a_gate_waits_the_page_answers_when_it_is_back(
    lab: LabOnThisMachine, folder: Path
) -> None:
    with serving(folder) as (addresses, process):
        pages = served(folder, addresses)
        run = pages.start()["id"]
        pages.until(run, "Suspended")
        lab.postgres.kill()
        lab.postgres.start()
        told = again(lambda: pages.resume(run, **of_page(folder)))
        assert told["status"] == "ACCEPT"
        again(lambda: pages.until(run, "Completed"))
        assert process.poll() is None
    assert done_once(folder)
