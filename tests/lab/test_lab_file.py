"""lab.yaml: what is in it, and one line for what is wrong; no server is asked."""

from pathlib import Path

import pytest
import yaml

from bumblebee.errors import BadInput
from flows.environment import environment
from tasks.lab.checks import revisions
from tasks.lab.servers import read_lab

GOOD = {
    "prefect": {"database": "postgresql://bumblebee@db.lab:5433/prefect"},
    "mlflow": {
        "database": "postgresql://bumblebee@db.lab/mlflow",
        "artifacts": "s3://bumblebee/mlflow",
        "s3_endpoint": "https://s3.lab:8333",
    },
}


def write(folder: Path, content: object) -> Path:
    (folder / "lab.yaml").write_text(yaml.safe_dump(content))
    return folder


def changed(section: str, key: str, value: object) -> dict:
    return {**GOOD, section: {**GOOD[section], key: value}}


def cluster(**over: object) -> dict:
    return {**GOOD, "ray": {"address": "head.lab:6379", "remote": "/shared/dvc", **over}}


@pytest.mark.parametrize("remote", ["/shared/dvc", "s3://bumblebee/dvc", "ssh://me@files.lab:22/srv/dvc"])
def test_a_cluster_is_read_and_its_token_demanded(tmp_path: Path, remote: str) -> None:
    lab = read_lab(write(tmp_path, cluster(remote=remote)))
    assert lab is not None and lab.ray is not None and lab.ray.remote == remote
    assert environment(tmp_path)["RAY_AUTH_MODE"] == "token"


def test_memory_and_times_of_a_cluster_are_numbers_of_their_units(tmp_path: Path) -> None:
    lab = read_lab(write(tmp_path, cluster(address="auto", memory={"base": 12, "distill": 0.5}, checkpoint_seconds=5)))
    assert lab is not None and lab.ray is not None
    assert (lab.ray.memory, lab.ray.checkpoint_seconds) == ({"base": 12.0, "distill": 0.5}, 5.0)
    plain = read_lab(write(tmp_path, cluster()))
    assert plain is not None and plain.ray is not None
    assert (plain.ray.memory, plain.ray.checkpoint_seconds) == ({}, 60.0)


def test_without_a_cluster_no_process_is_told_of_ray(tmp_path: Path) -> None:
    lab = read_lab(write(tmp_path, GOOD))
    assert lab is not None and lab.ray is None and not any(name.startswith("RAY") for name in lab.variables)


def test_without_the_file_everything_is_on_this_machine(tmp_path: Path) -> None:
    assert read_lab(tmp_path) is None
    assert "PREFECT_API_DATABASE_CONNECTION_URL" not in environment(tmp_path)


def test_processes_are_told_where_things_are(tmp_path: Path) -> None:
    lab = read_lab(write(tmp_path, GOOD))
    assert lab is not None and (lab.mlflow.bucket, lab.mlflow.folder) == ("bumblebee", "mlflow")
    told = environment(tmp_path)
    assert told["PREFECT_API_DATABASE_CONNECTION_URL"] == "postgresql+asyncpg://bumblebee@db.lab:5433/prefect"
    assert told["MLFLOW_S3_ENDPOINT_URL"] == "https://s3.lab:8333"


@pytest.mark.parametrize(
    ("content", "line"),
    [
        (changed("mlflow", "database", "postgresql://u:secret@db/mlflow"), "without a password, came one with it"),
        (changed("prefect", "database", "sqlite:///x"), "prefect.database: expected postgresql://USER@HOST"),
        (
            changed("prefect", "database", "postgresql://db/prefect"),
            "prefect.database: expected postgresql://USER@HOST",
        ),
        (changed("prefect", "database", "postgresql://u@db:99999/prefect"), "prefect.database: expected postgresql"),
        (changed("mlflow", "artifacts", "/srv/artifacts"), "mlflow.artifacts: expected s3://BUCKET/FOLDER"),
        (changed("mlflow", "s3_endpoint", "s3.lab"), "mlflow.s3_endpoint: expected https://HOST"),
        (changed("mlflow", "bucket", "x"), "mlflow.bucket: expected database or artifacts or s3_endpoint"),
        (changed("mlflow", "artifacts", 3), "mlflow.artifacts: expected a text, came int"),
        (changed("mlflow", "database", GOOD["prefect"]["database"]), "another database than Prefect's"),
        ({"prefect": GOOD["prefect"]}, "mlflow: expected a mapping with database, artifacts, s3_endpoint"),
        ({**GOOD, "slurm": {}}, "slurm: expected prefect or mlflow or ray or serve or tracking, came an unknown key"),
        ({**GOOD, "ray": {}}, "ray.address: expected an address, came no such key"),
        (cluster(address="ray://head:6379"), "ray.address: expected HOST:PORT of the cluster's head"),
        (cluster(address="head:99999"), "ray.address: expected HOST:PORT of the cluster's head"),
        (cluster(remote="shared/dvc"), "ray.remote: expected a folder from / on"),
        (cluster(remote="ssh://me:secret@host/dvc"), "ray.remote: expected a folder from / on"),
        (cluster(memory=12), "ray.memory: expected GiB by stage, such as {base: 12}, came int"),
        (cluster(memory={"base": "12G"}), "ray.memory.base: expected a number from 0.001 to 1e+06, came str"),
        (cluster(memory={"base": True}), "ray.memory.base: expected a number from 0.001 to 1e+06, came True"),
        (cluster(checkpoint_seconds=0), "ray.checkpoint_seconds: expected a number from 1 to 86400, came 0"),
        ([1], "prefect: expected a mapping"),
        (
            changed("prefect", "database", "postgresql://u@db/prefect?password=secret"),
            "came another form (postgresql://..., a user, a query)",
        ),
        (changed("prefect", "database", "u:secret@db/prefect"), "came another form (a user)"),
        (changed("mlflow", "s3_endpoint", "https://key:secret@s3.lab"), "came another form (https://..., a user)"),
        (
            changed("mlflow", "s3_endpoint", "https://s3.lab/?key=secret"),
            "came another form (https://..., a query)",
        ),
        (
            changed("mlflow", "artifacts", "s3://key:secret@bumblebee/mlflow"),
            "came another form (s3://..., a user)",
        ),
        (changed("mlflow", "artifacts", "secret"), "mlflow.artifacts: expected s3://BUCKET/FOLDER, came another form"),
        (cluster(address="me:secret@head:6379"), "came another form (a user)"),
        (cluster(remote="s3://secret@bumblebee/dvc#secret"), "came another form (s3://..., a user, a fragment)"),
        (cluster(checkpoint_seconds="secret"), "came str"),
    ],
)
def test_what_is_wrong_is_one_line_and_shows_no_password(tmp_path: Path, content: object, line: str) -> None:
    with pytest.raises(BadInput) as caught:
        read_lab(write(tmp_path, content))
    assert line in str(caught.value) and "\n" not in str(caught.value) and "secret" not in str(caught.value)


def test_the_versions_of_tables_that_the_installed_programs_know_are_found() -> None:
    for program, least in (("mlflow", 30), ("prefect", 50)):
        known, newest = revisions(program)
        assert len(known) > least and len(newest) == 1 and newest < known
