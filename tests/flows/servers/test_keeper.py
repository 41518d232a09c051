"""Who keeps the servers: one process at a time, they end with it, and it ends in order; with stand-ins for both."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from bumblebee.errors import BadInput
from flows import attend, runs
from flows.servers import servers

# Answers as a guarded server does, and nothing else; ends with its parent.
FRONT = """
import argparse, pathlib, socket, sys
sys.path.insert(0, {home!r})
from flows.people import guard, login
from tasks.running.parent import end_with_parent
end_with_parent()
parser = argparse.ArgumentParser()
for name in ("name", "--workspace", "--socket", "--keeper"):
    parser.add_argument(name)
options = parser.parse_args()
listener = socket.socket(fileno=int(options.socket))
listener.listen()
password = login.read(pathlib.Path(options.workspace) / ".servers")
while True:
    connection, _ = listener.accept()
    nonce = connection.recv(9999).decode().partition("nonce=")[2].split()[0]
    connection.sendall(b"HTTP/1.0 200 OK\\r\\n\\r\\n" + guard.proof(password, nonce).encode())
    connection.close()
"""
# A keeper, as flows.demo is one, whose walk starts a stage and waits for it.
KEEPER = """
import sys
sys.path.insert(0, {home!r})
from pathlib import Path
from flows import attend, processes, runs
from flows.servers import servers
servers.FRONT = [sys.executable, "-c", Path({front!r}).read_text()]
attend.end_tree = lambda pid: processes.end_tree(pid, limit=0.5)  # the stubborn walk is not waited for
attend.WALK = [sys.executable, "-c", Path({walk!r}).read_text()]
runs.clear_lost = lambda *_, **__: []
with attend.ended_in_order():
    try:
        with servers.servers(Path({folder!r})) as addresses:
            print(*addresses.pids, flush=True)
            status = attend.attend(Path({folder!r}), addresses, until_lost={until_lost})
    except KeyboardInterrupt:
        status = 130
sys.exit(status)
"""
WALK = """
import os, signal, subprocess, sys, time
from pathlib import Path
sys.path.insert(0, {home!r})
from tasks.running.parent import end_with_parent
end_with_parent()
told = []
signal.signal(signal.SIGUSR1, lambda *_: told.append(1))
signal.signal(signal.SIGTERM, signal.SIG_IGN)  # as stubborn as Prefect can be
stage = subprocess.Popen([sys.executable, "-c", "import sys; sys.path.insert(0, {home!r}); from tasks.running.parent "
    "import end_with_parent; end_with_parent(); import time; time.sleep(60)"],
    stderr=subprocess.DEVNULL)
Path({folder!r}, "walk.pid").write_text(f"{{os.getpid()}} {{stage.pid}}")
while not told:
    time.sleep(0.02)
sys.exit(7)
"""


class Keeper:
    """A keeper in a process of its own, and everything that it started."""

    def __init__(self, folder: Path, until_lost: bool = False) -> None:
        names = {"home": str(servers.HOME), "folder": str(folder), "until_lost": until_lost}
        names |= {"front": str(folder / "front.py"), "walk": str(folder / "walk.py")}
        (folder / "front.py").write_text(FRONT.format(**names))
        (folder / "walk.py").write_text(WALK.format(**names))
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        code = KEEPER.format(**names)
        self.process = subprocess.Popen([sys.executable, "-c", code], cwd=folder, start_new_session=True, **pipes)
        assert self.process.stdout is not None
        self.servers = [int(word) for word in self.process.stdout.readline().split()]
        mark = folder / "walk.pid"
        while not (mark.exists() and len(mark.read_text().split()) == 2):
            assert self.process.poll() is None, self.process.communicate()
            time.sleep(0.02)
        walk = [int(word) for word in mark.read_text().split()]
        self.all = [psutil.Process(pid) for pid in [*self.servers, *walk]]

    def left(self) -> list[psutil.Process]:
        """Processes of it that do not end within a few seconds."""
        return [p for p in psutil.wait_procs(self.all, timeout=30)[1] if p.status() != psutil.STATUS_ZOMBIE]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A workspace; servers that this process starts in it are stand-ins."""
    code = FRONT.format(home=str(servers.HOME))
    monkeypatch.setattr(servers, "FRONT", [sys.executable, "-c", code])
    monkeypatch.setattr(runs, "clear_lost", lambda *_, **__: [])
    monkeypatch.setattr(os, "environ", dict(os.environ))
    yield tmp_path


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_both_servers_and_every_child_and_leaves_no_address(folder: Path, number: signal.Signals):
    keeper = Keeper(folder)
    keeper.process.send_signal(number)
    _, error = keeper.process.communicate(timeout=60)
    assert keeper.process.returncode == 130 and "Traceback" not in error
    assert keeper.left() == []
    assert not (folder / ".servers" / "addresses.json").exists() and servers.running(folder) is None


def test_nothing_outlives_a_keeper_that_was_killed_and_the_next_one_starts(folder: Path):
    keeper = Keeper(folder)
    keeper.process.kill()
    keeper.process.communicate(timeout=60)
    with servers.servers(folder) as again:
        assert again.keeper == os.getpid() and set(again.pids).isdisjoint(keeper.servers)
    assert keeper.left() == []


def test_when_the_flow_is_killed_its_stage_goes_with_it_and_the_keeper_ends_the_servers(folder: Path):
    keeper = Keeper(folder)
    walk, stage = keeper.all[-2:]
    stage.suspend()  # it cannot notice by itself that its parent is gone
    walk.kill()
    _, error = keeper.process.communicate(timeout=60)
    assert keeper.process.returncode == 1 and "Traceback" not in error
    assert keeper.left() == []
    assert not (folder / ".servers" / "addresses.json").exists()


def test_a_walk_whose_server_is_lost_is_told_and_goes_on_to_its_own_end(folder: Path):
    keeper = Keeper(folder)
    os.kill(keeper.servers[0], signal.SIGKILL)
    _, error = keeper.process.communicate(timeout=60)
    assert keeper.process.returncode == 7
    assert error.count("Prefect's server went away: the stages go on and what they finish is kept") == 1
    assert keeper.left() == []


def test_serving_ends_with_one_line_when_the_server_is_lost(folder: Path):
    keeper = Keeper(folder, until_lost=True)
    os.kill(keeper.servers[0], signal.SIGKILL)
    _, error = keeper.process.communicate(timeout=60)
    assert keeper.process.returncode == 1 and error.count("Prefect's server went away") == 1
    assert keeper.left() == []


def test_two_that_start_at_the_same_instant_share_the_servers_of_one(folder: Path):
    first = Keeper(folder)
    with servers.servers(folder) as found:  # as the second
        assert (found.keeper, list(found.pids)) == (first.process.pid, first.servers)
        line = rf"--mlflow-port: .* already run .*kept by process {found.keeper}"
        with pytest.raises(BadInput, match=line), servers.servers(folder, 0, 50001):
            pass
        same = int(found.prefect.rpartition(":")[2])
        with servers.servers(folder, same) as once_more:
            assert once_more == found
    assert servers.running(folder) == found, "who only used them must leave them"
    first.process.terminate()
    first.process.communicate(timeout=60)


def test_a_start_that_fails_leaves_nothing_and_takes_nobodys_address(folder: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(servers, "FRONT", [sys.executable, "-c", "raise SystemExit('no luck')"])
    with pytest.raises(BadInput, match="came no luck"), servers.servers(folder):
        pass
    assert not (folder / ".servers" / "addresses.json").exists()
    with pytest.raises(BadInput, match="a free port"), servers.listener() as taken:
        taken.listen()
        with servers.servers(folder, taken.getsockname()[1]):
            pass


def test_who_took_a_servers_port_later_is_not_taken_for_it(folder: Path):
    with servers.servers(folder):
        table = json.loads((folder / ".servers" / "addresses.json").read_text())
    with servers.listener() as thief:
        url = f"http://127.0.0.1:{thief.getsockname()[1]}"
        code = "import http.server, socket, sys; s = socket.socket(fileno=int(sys.argv[1])); s.listen()\n"
        code += "while True: c, _ = s.accept(); c.recv(999); c.sendall(b'HTTP/1.0 200 OK\\r\\n\\r\\nyes'); c.close()"
        command = [sys.executable, "-c", code, str(thief.fileno())]
        with subprocess.Popen(command, pass_fds=[thief.fileno()]) as process:
            (folder / ".servers" / "addresses.json").write_text(json.dumps({**table, "prefect": url, "mlflow": url}))
            assert servers.running(folder) is None
            process.kill()


def test_a_run_is_gone_when_its_process_is_and_a_suspended_one_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    asked: list[tuple[str, dict]] = []

    def ask(server: str, password: str, what: str, body: dict) -> list[dict]:
        asked.append((what, body))
        found = {"flow_runs/filter": ["here", "gone", "reused"], "task_runs/filter": ["stage"]}.get(what, [])
        return [{"id": name, "name": name} for name in found]

    monkeypatch.setattr(runs, "ask", ask)
    for name in ("gone", "reused"):
        (tmp_path / "runs").mkdir(exist_ok=True)
        pid = 2**22 + 1 if name == "gone" else os.getpid()
        (tmp_path / "runs" / f"{name}.json").write_text(json.dumps({"pid": pid, "born": 1.0}))
    with runs.recorded(tmp_path, "here"):
        assert runs.clear_lost(tmp_path, "http://x", "secret") == ["gone", "reused"]
    assert "PAUSED" not in json.dumps(asked[0][1]) and "RUNNING" in json.dumps(asked[0][1])
    set_to = [(what, body["state"]["type"]) for what, body in asked if what.endswith("set_state")]
    crashed = "task_runs/stage", "flow_runs/gone", "task_runs/stage", "flow_runs/reused"
    assert set_to == [(f"{name}/set_state", "CRASHED") for name in crashed]
    assert list((tmp_path / "runs").iterdir()) == []


def test_what_was_ignored_when_the_program_started_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with attend.ended_in_order():
            os.kill(os.getpid(), signal.SIGHUP)
            with pytest.raises(KeyboardInterrupt):
                os.kill(os.getpid(), signal.SIGTERM)
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN, "a second signal must not interrupt the clearing"
    finally:
        signal.signal(signal.SIGHUP, before)
    assert signal.getsignal(signal.SIGINT) is not signal.SIG_IGN
