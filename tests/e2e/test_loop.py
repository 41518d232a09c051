"""The loop end to end, small: killed and resumed, stopped at the gate, answered from another process, finished.

One workspace for all tests. Its first half runs as the Prefect flow with both servers, its second as plain `dvc repro`,
so that both ways are taken and meet in the same files.
"""

import getpass
import hashlib
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
import urllib.request
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest
import yaml

from bumblebee.learning.learner import CHECKPOINT
from flows import demo
from flows import workspace as workspaces
from flows.environment import environment
from flows.people import login
from flows.servers import servers
from flows.stages import changed_stages, read_stages
from tasks import registry

pytestmark = pytest.mark.e2e
LIMIT = 600  # [s] for any one command
ITERATIONS = 60  # of the base policy
FEW = {"env": {"num_worlds": 8}}
WINDOWS = {"max_windows": 12, "max_holdout_windows": 8, "report_windows": 8}


@dataclass(frozen=True)
class Loop:
    """Record of a loop: what happened on the way."""

    folder: Path
    killed: str
    """Output of the flow up to its kill in the stage base."""
    left_running: list[str]
    """Processes of the loop that outlived the kill."""
    waiting: subprocess.CompletedProcess[str]
    """The flow that ended at the gate."""
    stopped: subprocess.CompletedProcess[str]
    """`dvc repro` without an answer."""
    answer: subprocess.CompletedProcess[str]
    """The answer, from another process."""
    finished: subprocess.CompletedProcess[str]
    """`dvc repro` to the end."""


def call(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", *words]
    return subprocess.run(
        command, cwd=folder, env=environment(folder), capture_output=True, text=True, timeout=LIMIT, check=False
    )


def printed_answer(output: str) -> list[str]:
    """Words of the command that the waiting loop printed, without the program's path."""
    command = next((part for part in output.split("`") if " approve " in part), None)
    assert command is not None, f"the loop printed no way to answer:\n{output}"
    return shlex.split(command)[1:]


def run_until_base_and_kill(folder: Path) -> tuple[str, list[str]]:
    """Start the flow, kill it with -9 when base has saved a checkpoint; its output, and what of it still runs later."""
    log = folder / "killed.log"
    with log.open("w") as out:
        flow = subprocess.Popen(
            [sys.executable, "-m", "flows.demo", "--verbose", "--workspace", str(folder)],
            cwd=folder,
            env=environment(folder),
            stdout=out,
            stderr=subprocess.STDOUT,
        )
    end = time.monotonic() + LIMIT
    checkpoint = folder / ".scratch" / "base-base" / CHECKPOINT
    while not checkpoint.exists() and flow.poll() is None and time.monotonic() < end:
        time.sleep(0.05)
    assert flow.poll() is None, log.read_text()
    below = [p for p in psutil.Process(flow.pid).children(recursive=True) if "server" not in p.cmdline()]
    below = [p for p in below if any(word.startswith(("tasks.", "flows.")) for word in p.cmdline())]
    assert below, "the stage base must be running"
    flow.send_signal(signal.SIGKILL)
    flow.wait()
    _, alive = psutil.wait_procs(below, timeout=30)
    return log.read_text(), [" ".join(p.cmdline()) for p in alive if p.is_running()]


@pytest.fixture(scope="module")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Loop:
    over = {
        "gate": {"mode": "ask"},
        "base": {**FEW, "ppo": {"iterations": ITERATIONS}},  # long enough for the kill to come before its end
        **dict.fromkeys(("experts", "refine", "distill"), FEW),
        # Time for the first effect: the whole search takes half a minute or several, by what was sealed and measured.
        "diagnose": {"search_seconds": 5.0, "beyond_seconds": 1.0, **WINDOWS},
        "control": {"kinds": ["delta"]},  # all that the other kind does, and more
    }
    folder = workspaces.create(tmp_path_factory.mktemp("e2e") / "smoke", "smoke", **over)
    killed, left = run_until_base_and_kill(folder)
    waiting = call(folder, "flows.demo", "--verbose", "--workspace", str(folder))
    assert waiting.returncode == demo.EXIT_WAITING, f"{waiting.returncode}: {waiting.stdout}\n{waiting.stderr}"
    stopped = call(folder, "dvc", "repro")
    answer = call(folder, "bumblebee", *printed_answer(waiting.stderr))
    finished = call(folder, "dvc", "repro")
    return Loop(folder, killed, left, waiting, stopped, answer, finished)


def test_a_kill_leaves_no_stage_running_and_costs_only_the_running_one(loop: Loop):
    assert loop.left_running == []
    assert " motions | " in loop.killed and " base | " in loop.waiting.stderr
    assert " motions | " not in loop.waiting.stderr, "a stage that had finished ran again"


def test_a_gate_that_nobody_answered_stops_both_ways_with_the_line_that_says_how(loop: Loop):
    assert loop.waiting.returncode == demo.EXIT_WAITING, loop.waiting.stderr
    assert loop.stopped.returncode != 0
    for output in (loop.waiting.stderr, loop.stopped.stdout + loop.stopped.stderr):
        assert printed_answer(output)[:3] == ["gate", "approve", "1"]


def test_an_answer_from_another_process_lets_it_go_on(loop: Loop):
    assert loop.answer.returncode == 0, loop.answer.stderr
    gate = json.loads((loop.folder / "data" / "gates" / "round-1.json").read_text())
    assert (gate["status"], gate["by"], gate["known_by"]["uid"]) == ("approved", getpass.getuser(), os.getuid())
    assert loop.finished.returncode == 0, loop.finished.stdout[-3000:] + loop.finished.stderr[-3000:]


def test_every_output_of_every_stage_is_there(loop: Loop):
    lock = yaml.safe_load((loop.folder / "dvc.lock").read_text())["stages"]
    assert set(lock) == {stage.name for stage in read_stages(loop.folder)}
    outs = [out["path"] for stage in lock.values() for out in stage["outs"]]
    assert [path for path in outs if not (loop.folder / path).exists()] == []
    assert (loop.folder / "reports" / "report.html").stat().st_size > 10_000
    assert not list(loop.folder.rglob(".*.writing"))


def test_mlflow_has_a_run_of_every_stage_with_all_of_its_outputs(loop: Loop, monkeypatch: pytest.MonkeyPatch):
    for name, value in environment(loop.folder).items():
        monkeypatch.setenv(name, value)
    monkeypatch.chdir(loop.folder)
    client = registry.prepare()
    experiment = client.get_experiment_by_name(registry.experiment_name())
    lock = yaml.safe_load((loop.folder / "dvc.lock").read_text())["stages"]
    for name, stage in lock.items():
        run = client.search_runs([experiment.experiment_id], f"tags.dvc_stage = '{name}' and tags.record != ''")[0]
        file = Path(".servers/artifacts/runs", run.info.run_id, "artifacts/outputs.json")
        logged = {out["path"]: out["md5"] for out in json.loads(file.read_text())["outputs"]}
        assert logged == {out["path"]: out["md5"] for out in stage["outs"]}, name


def test_a_second_run_does_nothing(loop: Loop):
    assert changed_stages(loop.folder) == set()
    before = (loop.folder / "dvc.lock").read_bytes()
    assert "up to date" in call(loop.folder, "dvc", "repro").stdout
    again = call(loop.folder, "flows.demo", "--workspace", str(loop.folder))
    assert again.returncode == 0 and "is up to date" in again.stdout and "Prefect  " not in again.stdout
    assert (loop.folder / "dvc.lock").read_bytes() == before


def test_a_training_that_was_killed_and_resumed_ends_in_the_same_policy(loop: Loop):
    assert re.search(rf"base: goes on after iteration [1-9]\d* of {ITERATIONS}", loop.waiting.stderr), "it began anew"
    policy = loop.folder / "models" / "base" / "policy.onnx"
    resumed = hashlib.sha256(policy.read_bytes()).hexdigest()
    again = call(loop.folder, "dvc", "repro", "--force", "--single-item", "base")
    assert again.returncode == 0, again.stderr
    assert hashlib.sha256(policy.read_bytes()).hexdigest() == resumed


def test_the_registry_resolves_its_aliases_through_the_server(loop: Loop, monkeypatch: pytest.MonkeyPatch):
    for name, value in environment(loop.folder).items():
        monkeypatch.setenv(name, value)
    published = json.loads((loop.folder / "data" / "published.json").read_text())["models"]
    assert {"base", "generalist", "expert-c0", "expert-c1"} <= set(published)
    with servers.servers(loop.folder) as addresses:
        for name, facts in published.items():
            query = f"registered-models/alias?name={name}&alias=champion"
            version = fetch(loop.folder, f"{addresses.mlflow}/api/2.0/mlflow/{query}")["model_version"]
            assert version["version"] == facts["champion"]
            tags = {tag["key"]: tag["value"] for tag in version["tags"]}
            assert {"git_sha", "onnx_sha256", "evaluation_contract", "lineage"} <= set(tags)
        pids = addresses.pids
    assert not any(servers.alive(pid) for pid in pids)
    assert servers.running(loop.folder) is None


def fetch(folder: Path, url: str) -> dict:
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    header = {"Authorization": login.header(login.read(folder / ".servers"))}
    with opener.open(urllib.request.Request(url, headers=header), timeout=30) as reply:
        return json.loads(reply.read())


def test_the_sealed_effects_stay_sealed_from_those_who_search(loop: Loop):
    lock = yaml.safe_load((loop.folder / "dvc.lock").read_text())["stages"]
    readers = {name.partition("@")[0] for name, stage in lock.items() for dep in stage.get("deps", [])
               if dep["path"].startswith("data/sealed")}  # fmt: skip
    assert readers == {"rollouts", "evaluate", "report"}
    assert os.path.exists(loop.folder / "data" / "sealed" / "robot.json")
