"""Ports and processes of the servers; the servers themselves run in the end-to-end test."""

import os
import socket
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import psutil
import pytest

from bumblebee.errors import BadInput
from flows import demo
from flows.environment import environment
from flows.servers import serve, servers


def test_a_taken_port_is_one_line():
    with servers.listener() as taken:
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(BadInput, match=f"port {port} of 127.0.0.1: expected a free port, came"):
            servers.listener(port)


def test_a_port_is_held_from_the_moment_that_it_is_chosen():
    with servers.listener() as held, pytest.raises(BadInput):
        held.listen()
        servers.listener(held.getsockname()[1])


@pytest.mark.parametrize("option", ["--prefect-port", "--mlflow-port"])
@pytest.mark.parametrize("port", ["99999", "-1", "80", "1023", "65536"])
@pytest.mark.parametrize("program", [demo, serve])
def test_a_number_that_is_no_port_is_one_line_before_anything_starts(
    program: ModuleType, option: str, port: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    for place in (demo, serve):
        monkeypatch.setattr(place, "servers", None)
    assert program.main([option, port]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and error.startswith(f"{option}: expected 0 (any free port) or a port from 1024")


def test_the_demo_ends_with_status_2_on_a_taken_port(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setattr(demo, "choose", lambda *_: tmp_path)
    (tmp_path / "params.yaml").write_text("clusters: [c0]\nrounds: []\nfinal_round: 0\n")
    monkeypatch.setattr(demo, "start_check", lambda _: None)
    monkeypatch.setattr(demo, "read_stages", lambda _: [])
    monkeypatch.setattr(demo, "changed_stages", lambda _: set())
    monkeypatch.setattr(demo, "to_run", lambda *_: {"seal"})
    monkeypatch.setattr(os, "environ", dict(os.environ))
    with socket.socket() as taken:
        taken.bind((servers.HOST, 0))
        taken.listen()
        assert demo.main(["--prefect-port", str(taken.getsockname()[1])]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "a free port" in error


def test_stopping_ends_what_a_server_started_too():
    code = "import subprocess, sys; p = subprocess.Popen(['sleep', '60']); print(p.pid, flush=True); p.wait()"
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, start_new_session=True)
    assert process.stdout is not None
    started = psutil.Process(int(process.stdout.readline()))
    servers.stop([process.pid])
    assert not servers.alive(process.pid)
    assert psutil.wait_procs([started], timeout=10)[1] == [] or started.status() == psutil.STATUS_ZOMBIE


def test_no_addresses_no_servers(tmp_path: Path):
    assert servers.running(tmp_path) is None
    (tmp_path / ".servers").mkdir()
    (tmp_path / ".servers" / "addresses.json").write_text("{half")
    assert servers.running(tmp_path) is None


def test_everything_stays_in_the_workspace_and_nothing_is_reported_home(tmp_path: Path):
    found = environment(tmp_path)
    assert found["PATH"].split(os.pathsep)[0] == str(Path(sys.executable).parent)
    inside = ("PREFECT_HOME", "PREFECT_PROFILES_PATH", "DVC_SITE_CACHE_DIR")
    assert all(Path(found[name]).is_relative_to(tmp_path.resolve()) for name in inside)
    assert found["PREFECT_SERVER_ALLOW_EPHEMERAL_MODE"] == "false" and found["DO_NOT_TRACK"] == "true"
