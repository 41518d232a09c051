"""The section `serve` of lab.yaml: nothing listens beyond this machine without TLS and people; one line says why."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from bumblebee.errors import BadInput
from flows.environment import SERVERS
from flows.people import accounts as people
from flows.people.lab_cli import app
from flows.servers import servers
from tasks.lab.serve import ServeLab, read_serve, read_tracking, tls
from tasks.lab.servers import read_lab
from tests.lab.doors import certificate, opened
from tests.lab.machines import free_port

GOOD = {
    "prefect": "https://data.lab:4200",
    "mlflow": "https://data.lab:5000",
    "prefect_listen": "127.0.0.1:14200",
    "mlflow_listen": "127.0.0.1:15000",
    "promote": "leads",
}


def write(folder: Path, **over: Any) -> Path:
    own = {key: value for key, value in {**GOOD, **over}.items() if value is not None}
    (folder / "lab.yaml").write_text(yaml.safe_dump({"serve": own}))
    return folder


def test_alone_it_opens_the_workspaces_own_history(tmp_path: Path) -> None:
    own = read_serve(write(tmp_path))
    assert own is not None and own.places["mlflow"] == ("127.0.0.1", 15000) and own.write == ""
    assert read_lab(tmp_path) is None and read_tracking(tmp_path) is None


def test_people_reach_a_workspaces_own_sqlite_history(tmp_path: Path) -> None:
    with opened(tmp_path / "alone", {}, proxied=False) as served:
        assert served.code(f"{served.prefect}/api/flow_runs/filter", "carl", {}) == 200
        assert served.code(f"{served.mlflow}/api/2.0/mlflow/experiments/search?max_results=1", "carl") == 200
        assert served.code(f"{served.mlflow}/api/2.0/mlflow/experiments/search?max_results=1", "bumblebee") == 401
        assert (served.folder / SERVERS / "mlflow.db").exists()


def test_beyond_loopback_with_a_certificate_and_its_key(tmp_path: Path) -> None:
    made, key = certificate(tmp_path)
    own = read_serve(write(tmp_path, prefect_listen="0.0.0.0:4200", certificate=str(made), key=str(key)))
    assert own is not None and own.places["prefect"] == ("0.0.0.0", 4200)


@pytest.mark.parametrize(
    ("over", "line"),
    [
        ({"prefect_listen": "0.0.0.0:4200"}, "serve.prefect_listen: expected TLS beyond this machine"),
        ({"mlflow_listen": "10.0.0.5:5000"}, "serve.mlflow_listen: expected TLS beyond this machine"),
        (
            {"prefect": "http://data.lab:4200"},
            "serve.prefect: expected https://HOST[:PORT], as people open it, came another form (http://...)",
        ),
        ({"mlflow": "https://data.lab/mlflow"}, "serve.mlflow: expected https://HOST[:PORT]"),
        ({"mlflow": "https://ann:secret@data.lab"}, "came another form (https://..., a user)"),
        ({"mlflow": "https://data.lab:99999"}, "serve.mlflow: expected https://HOST[:PORT]"),
        ({"mlflow": GOOD["prefect"]}, "another address than Prefect's"),
        ({"prefect_listen": "data.lab:4200"}, "serve.prefect_listen: expected ADDRESS:PORT"),
        ({"prefect_listen": "127.0.0.1:80"}, "serve.prefect_listen: expected ADDRESS:PORT"),
        ({"prefect_listen": "127.0.0.1"}, "serve.prefect_listen: expected ADDRESS:PORT"),
        ({"prefect_listen": None}, "serve.prefect_listen: expected an address, came no such key"),
        ({"certificate": "/not/there.pem"}, "certificate and key together"),
        ({"promote": "secret!"}, "serve.promote: expected a group's name"),
        ({"prefect_listen": "secret@0.0.0.0"}, "serve.prefect_listen: expected ADDRESS:PORT"),
        ({"password": "x"}, "serve.password: expected prefect or mlflow"),
        ({"write": 3}, "serve.write: expected a text, came int"),
    ],
)
def test_what_is_wrong_is_one_line(tmp_path: Path, over: dict[str, Any], line: str) -> None:
    with pytest.raises(BadInput) as caught:
        read_serve(write(tmp_path, **over))
    assert line in str(caught.value) and "\n" not in str(caught.value) and "secret" not in str(caught.value)


def test_a_key_that_others_can_read_or_of_another_certificate_is_refused(tmp_path: Path) -> None:
    made, key = certificate(tmp_path)
    own = ServeLab(**{**GOOD, "certificate": str(made), "key": str(key)})
    tls(own)
    key.chmod(0o644)
    with pytest.raises(BadInput, match=r"serve\.key: expected a file that only its owner can read"):
        tls(own)
    (tmp_path / "other").mkdir()
    _, other = certificate(tmp_path / "other")
    with pytest.raises(BadInput, match=r"serve\.certificate: expected a certificate and its key"):
        tls(replace(own, key=str(other)))
    with pytest.raises(BadInput, match=r"serve\.certificate: expected a file, by its whole path"):
        tls(replace(own, certificate=str(tmp_path / "not-there.pem")))
    with pytest.raises(BadInput, match=r"serve\.key: expected a file, by its whole path, came no whole path"):
        tls(replace(own, key=key.read_text()))


@pytest.mark.parametrize(
    ("content", "line"),
    [
        ({"tracking": "http://data.lab:5000"}, "tracking: expected https://HOST[:PORT]"),
        ({"tracking": "https://ann:secret@data.lab"}, "tracking: expected https://HOST[:PORT]"),
        ({"tracking": "https://data.lab", "serve": GOOD}, "serve: expected nothing beside tracking"),
        ({"tracking": "https://data.lab", "ray": {}}, "ray: expected nothing beside tracking"),
    ],
)
def test_stages_log_to_an_encrypted_server_alone(tmp_path: Path, content: dict[str, Any], line: str) -> None:
    (tmp_path / "lab.yaml").write_text(yaml.safe_dump(content))
    with pytest.raises(BadInput) as caught:
        read_tracking(tmp_path)
    assert line in str(caught.value) and "secret" not in str(caught.value)


def serve(folder: Path) -> subprocess.CompletedProcess[str]:
    """`make serve` in a workspace that cannot be served."""
    environment = {**os.environ, "PYTHONPATH": str(servers.HOME)}
    command = [sys.executable, "-m", "flows.servers.serve"]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=120
    )


def test_without_people_or_tls_or_on_a_taken_port_nothing_starts_and_one_line_says_so(tmp_path: Path) -> None:
    for name in ("dvc.yaml", "params.yaml"):
        (tmp_path / name).write_text("{}\n")
    ports = {f"{name}_listen": f"127.0.0.1:{free_port()}" for name in ("prefect", "mlflow")}
    done = serve(write(tmp_path, **ports))
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "expected personal logins, before servers listen for people, came none" in done.stderr
    people.add(tmp_path / SERVERS, "ann", ())
    for over, line in (
        ({"prefect_listen": "0.0.0.0:4200"}, "expected TLS"),
        ({"certificate": "/not/there.pem", "key": "/not/there.key"}, "serve.certificate: expected a file"),
    ):
        done = serve(write(tmp_path, **over))
        assert done.returncode == 2 and done.stderr.count("\n") == 1 and line in done.stderr
    with servers.listener() as taken:
        taken.listen()
        done = serve(write(tmp_path, **{**ports, "mlflow_listen": f"127.0.0.1:{taken.getsockname()[1]}"}))
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and "a free port" in done.stderr
    assert not (tmp_path / SERVERS / "prefect.log").exists()


def test_people_are_added_listed_and_removed_by_a_command(tmp_path: Path) -> None:
    from typer.testing import CliRunner

    (write(tmp_path) / "params.yaml").write_text("{}\n")
    where = ["--workspace", str(tmp_path)]
    done = CliRunner().invoke(app, ["user", "add", "ann", "--group", "leads", *where])
    assert done.exit_code == 0 and len(done.output.strip()) >= 32
    listed = CliRunner().invoke(app, ["user", "list", *where]).output
    assert "ann" in listed and "promote" in listed and done.output.strip() not in listed
    assert CliRunner().invoke(app, ["user", "remove", "ann", *where]).exit_code == 0
    assert people.read(tmp_path / SERVERS) == {}
