"""A lab on this machine: PostgreSQL and S3 with logins, and a workspace whose lab.yaml names them."""

import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.lab import cluster as clusters
from tests.lab import machines


@dataclass(frozen=True)
class LabOnThisMachine:
    """Its servers, and what a client needs."""

    postgres: machines.Postgres
    store: machines.Store
    password: str
    secret: str

    def content(self, **over: str) -> dict[str, dict[str, str]]:
        """Content of lab.yaml; `over` replaces keys of the section mlflow, `prefect_database` the other's."""
        prefect = over.pop("prefect_database", self.postgres.url("prefect"))
        own = {"database": self.postgres.url("mlflow"), "artifacts": f"s3://{self.store.bucket}/mlflow"}
        return {"prefect": {"database": prefect}, "mlflow": {**own, "s3_endpoint": self.store.endpoint, **over}}


@pytest.fixture(scope="session")
def lab() -> Iterator[LabOnThisMachine]:
    """One lab for all tests of a session."""
    if lacks := machines.missing():
        (pytest.fail if "BUMBLEBEE_LAB_TEST" in os.environ else pytest.skip)(f"no lab's servers here: {lacks}")
    password, secret, patch = machines.new_secret(), machines.new_secret(), pytest.MonkeyPatch()
    with tempfile.TemporaryDirectory(dir="/tmp") as scratch:  # a socket's path must be short
        folder = Path(scratch)
        folder.chmod(0o755)
        with machines.postgres(folder / "pg", password) as postgres, machines.s3(folder / "s3", "lab", secret) as store:
            keys = folder / "credentials"
            keys.write_text(f"[default]\naws_access_key_id = lab\naws_secret_access_key = {secret}\n")
            passes = folder / "pgpass"
            passes.write_text(f"*:*:*:{machines.USER}:{password}\n")
            for file, name in ((keys, "AWS_SHARED_CREDENTIALS_FILE"), (passes, "PGPASSFILE")):
                file.chmod(0o600)
                patch.setenv(name, str(file))
            for name in [name for name in os.environ if name.startswith(("AWS_ACCESS", "AWS_SECRET", "AWS_PROFILE"))]:
                patch.delenv(name)
            try:
                yield LabOnThisMachine(postgres, store, password, secret)
            finally:
                patch.undo()


@pytest.fixture
def workspace(lab: LabOnThisMachine, tmp_path: Path) -> Path:
    """A folder with nothing but lab.yaml and a name of its own."""
    folder = tmp_path / f"work-{machines.new_secret()[:6]}"
    folder.mkdir()
    (folder / "lab.yaml").write_text(yaml.safe_dump(lab.content()))
    (folder / "params.yaml").write_text("clusters: [c0]\nrounds: []\nfinal_round: 0\n")
    return folder


@dataclass(frozen=True)
class Stand:
    """A cluster that runs, and what a workspace needs to use it."""

    cluster: clusters.Cluster
    content: dict[str, Any]
    """Content of lab.yaml."""


@pytest.fixture(scope="session")
def stand(lab: LabOnThisMachine) -> Iterator[Stand]:
    """One cluster for all tests of a session, two workers at first; a test kills one of them."""
    if find_spec("ray") is None:
        (pytest.fail if "BUMBLEBEE_LAB_TEST" in os.environ else pytest.skip)("no package ray")
    patch = pytest.MonkeyPatch()
    with tempfile.TemporaryDirectory(dir="/tmp", ignore_cleanup_errors=True) as scratch:
        folder = Path(scratch)
        (folder / "dvc").mkdir()
        clusters.new_token(folder / "token")
        patch.setenv("RAY_AUTH_MODE", "token")
        patch.setenv("RAY_AUTH_TOKEN_PATH", str(folder / "token"))
        try:
            with clusters.cluster(folder, 2) as made:
                ray = {"address": made.address, "remote": str(folder / "dvc"), "checkpoint_seconds": 1}
                yield Stand(made, {**lab.content(), "ray": ray})
        finally:
            patch.undo()
