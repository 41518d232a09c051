"""A workspace that both servers have open: three tiny stages, the last behind a gate; a model without a file."""

import json
import shutil
import sys
import time
import urllib.error
import urllib.request
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from bumblebee.measured.intake import FINDING_COLUMNS
from flows import runs
from flows.people import login
from flows.servers import servers
from flows.servers.servers import Addresses

LIMIT = 240  # [s] for anything to happen; a loaded machine with two cores is slow
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)


@dataclass(frozen=True)
class Served:
    """A workspace that `flows.servers.serve` has open."""

    folder: Path
    addresses: Addresses
    password: str

    def ask(self, what: str, **body: Any) -> Any:
        """Prefect's answer; its database may be busy for a moment."""
        for _ in range(20):
            try:
                return runs.ask(self.addresses.prefect, self.password, what, body)
            except urllib.error.HTTPError as error:
                if error.code != 503:
                    raise
                time.sleep(0.5)
        raise TimeoutError(what)

    def until(self, run: str, *states: str) -> dict[str, Any]:
        """Wait until the run is in one of the states."""
        end = time.monotonic() + LIMIT
        while time.monotonic() < end:
            state = self.ask("flow_runs/filter", flow_runs={"id": {"any_": [run]}})[0]["state"]
            if state["name"] in states:
                return state
            if state["type"] in ("FAILED", "CRASHED"):
                break
            time.sleep(0.3)
        raise TimeoutError(state)

    def resume(self, run: str, **given: str) -> dict[str, Any]:
        """Answer of Prefect to an answer; it calls a run suspended a moment before the question is there."""
        end = time.monotonic() + LIMIT
        while time.monotonic() < end:
            told = self.ask(f"flow_runs/{run}/resume", run_input=given)
            if not asks_not_yet(told):
                break
            time.sleep(0.3)
        return dict(told)

    def start(self, **parameters: str) -> dict[str, Any]:
        """A run of the deployment."""
        end = time.monotonic() + LIMIT
        while not (found := self.ask("deployments/filter")) and time.monotonic() < end:
            time.sleep(0.3)
        return self.ask(f"deployments/{found[0]['id']}/create_flow_run", parameters=parameters)


def asks_not_yet(told: dict[str, Any]) -> bool:
    """Whether Prefect refused an answer since the run's question is not there yet."""
    return "schema not found" in str((told.get("details") or {}).get("reason"))


def make(folder: Path) -> Path:
    """A workspace with a gate: stages that write a word, a summary to answer for, and our code."""
    write = f"{sys.executable} -c \"open('{{}}', 'w').write('1')\""
    stages = {
        "one": {"cmd": write.format("a.txt"), "outs": ["a.txt"]},
        "two": {"cmd": write.format("b.txt"), "deps": ["a.txt"], "outs": ["b.txt"]},
        "gate": {"cmd": write.format("g.txt") + " --round 1", "deps": ["a.txt", "data/approvals/round-1.json"],
                 "outs": ["g.txt"]},
    }  # fmt: skip
    (folder / "data" / "measured" / "r1").mkdir(parents=True)
    (folder / "dvc.yaml").write_text(yaml.safe_dump({"stages": stages}))
    (folder / "params.yaml").write_text("clusters: [c0]\ngate: {mode: ask}\n")
    summary = {"round": 1, "accepted": 3, "quarantined": 1, "seconds": 4.0, "joints": ["knee"], "by_rule": {}}
    summary |= {"by_cluster": {}, "by_motion": {}, "files": []}
    (folder / "data" / "measured" / "r1" / "summary.json").write_text(json.dumps(summary))
    (folder / "data" / "measured" / "r1" / "findings.csv").write_text(",".join(FINDING_COLUMNS) + "\n")
    for name in ("bumblebee", "tasks", "flows"):
        (folder / name).symlink_to(servers.HOME / name)
    from dvc.repo import Repo

    Repo.init(str(folder), no_scm=True)
    return folder


def register(folder: Path) -> None:
    """A model with a champion, written straight into the database, as the registry's stage does."""
    import mlflow

    login.private(folder / ".servers")
    uri = f"sqlite:///{folder / '.servers'}/mlflow.db"
    client = mlflow.MlflowClient(tracking_uri=uri, registry_uri=uri)
    client.create_registered_model("expert-c0")
    client.create_model_version("expert-c0", source=str(folder / "a.txt"))
    client.set_registered_model_alias("expert-c0", "champion", "1")
