"""Prefect and MLflow on a lab's PostgreSQL and S3: the same history, after kills and from a backup, too."""

import json
import os
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import pytest
import yaml

from bumblebee.errors import BadInput
from flows.environment import SERVERS
from flows.people import login
from flows.runs import ask, clear_lost
from flows.servers.servers import servers
from tasks.lab.checks import check_lab, s3_client
from tasks.lab.servers import read_lab
from tests.lab import machines
from tests.lab.conftest import LabOnThisMachine

HOME = Path(__file__).parents[2]
LOG = """
from pathlib import Path
from tasks import registry
Path("file.txt").write_text("what a stage made")
print(registry.log_run("base", "c0", 1, {"seed": 3}, {"success": 0.5}, None, {}, [Path("file.txt")]))
"""


def stage(workspace: Path, code: str = LOG) -> subprocess.Popen[str]:
    """A process as `dvc repro` starts one: in the workspace, with no login to any server."""
    return subprocess.Popen(
        [sys.executable, "-c", code],
        cwd=workspace,
        env={**os.environ, "PYTHONPATH": str(HOME)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def logged(process: subprocess.Popen[str]) -> str:
    """The number of the run that it logged."""
    out, error = process.communicate(timeout=180)
    assert process.returncode == 0, error[-2000:]
    return out.strip().splitlines()[-1]


def mlflow(address: str, folder: Path, what: str, body: dict[str, Any] | None = None) -> bytes:
    """Answer of MLflow's interface."""
    headers = {"Authorization": login.header(login.read(folder / SERVERS) or ""), "Content-Type": "application/json"}
    asked = urllib.request.Request(f"{address}/{what}", json.dumps(body).encode() if body else None, headers)
    with urllib.request.build_opener(urllib.request.ProxyHandler({})).open(asked, timeout=60) as reply:
        return reply.read()


def shown(address: str, folder: Path, run: str) -> tuple[str, float, str]:
    """A run's cluster, its metric, and the text of its file, as MLflow's server gives them."""
    found = json.loads(mlflow(address, folder, f"api/2.0/mlflow/runs/get?run_id={run}"))["run"]
    tags = {tag["key"]: tag["value"] for tag in found["data"]["tags"]}
    file = mlflow(address, folder, f"get-artifact?run_id={run}&path=file.txt").decode()
    return tags["cluster"], found["data"]["metrics"][0]["value"], file


def test_a_run_that_a_stage_logs_is_in_postgresql_and_s3_and_on_the_servers_page(
    lab: LabOnThisMachine, workspace: Path
) -> None:
    run = logged(stage(workspace))  # without a server, as by plain `dvc repro`
    assert not (workspace / SERVERS / "mlflow.db").exists()
    assert run in lab.postgres.sql("SELECT run_uuid FROM runs", "mlflow")
    own = read_lab(workspace)
    assert own is not None
    keys = [item["Key"] for item in s3_client(own.mlflow).list_objects_v2(Bucket=lab.store.bucket)["Contents"]]
    assert any(key.endswith(f"{run}/artifacts/file.txt") for key in keys)
    assert not any(".check-" in key for key in keys)
    with servers(workspace) as made:
        assert shown(made.mlflow, workspace, run) == ("c0", 0.5, "what a stage made")
        flow = ask(made.prefect, login.read(workspace / SERVERS) or "", "flows/", {"name": "loop"})
        assert flow["id"] in lab.postgres.sql("SELECT id FROM flow", "prefect")
        anonymous = urllib.request.Request(f"{made.mlflow}/api/2.0/mlflow/runs/get?run_id={run}")
        with pytest.raises(urllib.error.HTTPError, match="401"):
            urllib.request.build_opener(urllib.request.ProxyHandler({})).open(anonymous, timeout=30)
    for file in (workspace / SERVERS).rglob("*"):
        if file.is_file():
            content = file.read_bytes()
            assert lab.password.encode() not in content and lab.secret.encode() not in content, file


def test_the_history_is_there_again_after_the_database_was_killed(lab: LabOnThisMachine, workspace: Path) -> None:
    with servers(workspace) as made:
        run = logged(stage(workspace))
        password = login.read(workspace / SERVERS) or ""
        flow = ask(made.prefect, password, "flows/", {"name": "before"})["id"]
        lab.postgres.kill()
        lab.postgres.start()
        assert shown(made.mlflow, workspace, run)[0] == "c0"
        for _ in range(10):  # a connection that died costs the request that finds out
            try:
                found = ask(made.prefect, password, "flows/filter", {"flows": {"id": {"any_": [flow]}}})
                break
            except urllib.error.HTTPError:
                continue
        assert [one["name"] for one in found] == ["before"]
        assert logged(stage(workspace)) != run


def test_restored_from_a_backup_the_servers_show_the_same(lab: LabOnThisMachine, workspace: Path) -> None:
    run = logged(stage(workspace))
    over = {}
    for name in ("prefect", "mlflow"):
        lab.postgres.sql(f"CREATE DATABASE {name}_again OWNER {machines.USER}")
        dump = lab.postgres.admin("pg_dump", "-d", name)
        lab.postgres.admin("psql", "-v", "ON_ERROR_STOP=1", "-q", "-d", f"{name}_again", text=dump)
        over["database" if name == "mlflow" else "prefect_database"] = lab.postgres.url(f"{name}_again")
    (workspace / "lab.yaml").write_text(yaml.safe_dump(lab.content(**over)))
    with servers(workspace) as made:
        assert shown(made.mlflow, workspace, run) == ("c0", 0.5, "what a stage made")
    for name in ("prefect", "mlflow"):
        lab.postgres.sql(f"DROP DATABASE {name}_again WITH (FORCE)")


def test_two_processes_that_begin_a_new_database_at_once_both_log(lab: LabOnThisMachine, tmp_path: Path) -> None:
    lab.postgres.sql(f"CREATE DATABASE fresh OWNER {machines.USER}")
    folders = [tmp_path / "one", tmp_path / "two"]  # no file lock in common: as two machines
    for folder in folders:
        folder.mkdir()
        (folder / "lab.yaml").write_text(yaml.safe_dump(lab.content(database=lab.postgres.url("fresh"))))
    runs = [logged(process) for process in [stage(folder) for folder in folders]]
    assert set(runs) == set(lab.postgres.sql("SELECT run_uuid FROM runs", "fresh").split())


def test_runs_of_other_machines_are_not_called_crashed(lab: LabOnThisMachine, workspace: Path) -> None:
    with servers(workspace) as made:
        password = login.read(workspace / SERVERS) or ""
        flow = ask(made.prefect, password, "flows/", {"name": "loop"})["id"]
        running = {"type": "RUNNING", "name": "Running"}
        there, here = (
            ask(made.prefect, password, "flow_runs/", {"flow_id": flow, "name": name, "state": running})["id"]
            for name in ("elsewhere", "killed-here")
        )
        records = workspace / SERVERS / "runs"
        records.mkdir(exist_ok=True)
        (records / f"{here}.json").write_text(json.dumps({"pid": 2**22 - 1, "born": 1.0}))
        assert clear_lost(workspace / SERVERS, made.prefect, password, shared=True) == ["killed-here"]
        found = ask(made.prefect, password, "flow_runs/filter", {"flow_runs": {"id": {"any_": [there]}}})
        assert found[0]["state"]["type"] == "RUNNING"


def faults(lab: LabOnThisMachine, folder: Path) -> dict[str, tuple[dict[str, str], str]]:
    """Faulty entries of lab.yaml -> what the one line must say."""
    nobody = lab.postgres.url("mlflow").replace(machines.USER, "nobody")
    return {
        "user": ({"database": nobody}, "mlflow.database: expected"),
        "database": ({"database": lab.postgres.url("none")}, 'database "none" does not exist'),
        "port": ({"database": f"postgresql://bumblebee@127.0.0.1:{machines.free_port()}/x"}, "Connection refused"),
        "bucket": ({"artifacts": "s3://not-there/mlflow"}, "s3://not-there/mlflow at http"),
        "endpoint": (
            {"s3_endpoint": f"http://127.0.0.1:{machines.free_port()}"},
            "to be writable, came Could not connect",
        ),
    }


@pytest.mark.parametrize("fault", ["user", "database", "port", "bucket", "endpoint"])
def test_what_does_not_answer_is_one_line_before_anything_starts(
    lab: LabOnThisMachine, workspace: Path, fault: str
) -> None:
    over, line = faults(lab, workspace)[fault]
    (workspace / "lab.yaml").write_text(yaml.safe_dump(lab.content(**over)))
    with pytest.raises(BadInput) as caught, servers(workspace):
        pass
    assert line in str(caught.value) and "\n" not in str(caught.value)
    assert not (workspace / SERVERS / "prefect.log").exists()


def test_a_wrong_password_and_wrong_keys_are_refused_without_showing_them(
    lab: LabOnThisMachine, workspace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = read_lab(workspace)
    assert own is not None
    (tmp_path / "keys").write_text("[default]\naws_access_key_id = lab\naws_secret_access_key = wrong-one\n")
    with monkeypatch.context() as patched:
        patched.setenv("AWS_SHARED_CREDENTIALS_FILE", str(tmp_path / "keys"))
        with pytest.raises(BadInput, match=r"mlflow\.artifacts: expected .* to be writable") as caught:
            check_lab(own, workspace)
        assert "wrong-one" not in str(caught.value)
    (tmp_path / "pgpass").write_text("*:*:*:*:wrong-one\n")
    (tmp_path / "pgpass").chmod(0o600)
    monkeypatch.setenv("PGPASSFILE", str(tmp_path / "pgpass"))
    with pytest.raises(BadInput, match="password authentication failed") as caught:
        check_lab(own, workspace)
    assert "wrong-one" not in str(caught.value)


def test_a_database_of_a_newer_version_and_one_to_read_only_are_refused(lab: LabOnThisMachine, workspace: Path) -> None:
    lab.postgres.sql(f"CREATE DATABASE newer OWNER {machines.USER}")
    lab.postgres.sql("CREATE TABLE alembic_version (version_num text)", "newer")
    lab.postgres.sql("INSERT INTO alembic_version VALUES ('feedfacecafe')", "newer")
    lab.postgres.sql("GRANT SELECT ON alembic_version TO PUBLIC", "newer")
    lab.postgres.sql("CREATE DATABASE to_read")
    lab.postgres.sql("REVOKE CREATE ON SCHEMA public FROM PUBLIC", "to_read")
    for name, line in (("newer", r"newer ones \(feedfacecafe\)"), ("to_read", "came one to read")):
        (workspace / "lab.yaml").write_text(yaml.safe_dump(lab.content(database=lab.postgres.url(name))))
        own = read_lab(workspace)
        assert own is not None
        with pytest.raises(BadInput, match=line):
            check_lab(own, workspace)
