"""The connection to MLflow: the workspace's own database and store, those of its lab, or a lab's server."""

import fcntl
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bumblebee.errors import BadInput
from tasks.lab.checks import one_at_a_time
from tasks.lab.database import ensure
from tasks.lab.private import private
from tasks.lab.serve import read_tracking
from tasks.lab.servers import MlflowLab, read_lab

if TYPE_CHECKING:
    from mlflow import MlflowClient

# Before anything of MLflow is imported: it reads this once, and would otherwise tell its maker of every use.
NO_TELEMETRY = "MLFLOW_DISABLE_TELEMETRY"
os.environ.setdefault(NO_TELEMETRY, "true")

SERVERS, DATABASE = Path(".servers"), "mlflow.db"
SCHEME = "mlflow-artifacts"


def prepare() -> "MlflowClient":
    """A client on the workspace's own database, which is made first if need be, by one process at a time."""
    return _prepared(Path.cwd())


@cache
def _prepared(workspace: Path) -> "MlflowClient":
    lab, server = read_lab(workspace), read_tracking(workspace)
    os.environ.setdefault("MLFLOW_ENABLE_ARTIFACTS_PROGRESS_BAR", "false")
    os.environ.setdefault("MLFLOW_SUPPRESS_PRINTING_URL_TO_STDOUT", "1")
    _quiet()
    import mlflow

    private(SERVERS)
    if server is not None:
        with _locked(SERVERS):
            client = of_server(server)
            _make_experiment(client)
        mlflow.set_experiment(experiment_name())
        return client
    uri = f"sqlite:///{(SERVERS / DATABASE).resolve()}" if lab is None else lab.mlflow.connection
    if lab is None:
        ensure_database(SERVERS.resolve())
    with _locked(SERVERS), nullcontext() if lab is None else one_at_a_time(lab.mlflow.database):
        mlflow.set_tracking_uri(uri)
        mlflow.set_registry_uri(uri)
        if lab is None:
            _serve_artifacts_locally()
        else:
            _store_artifacts_in(lab.mlflow)
        client = mlflow.MlflowClient(tracking_uri=uri, registry_uri=uri)
        _make_experiment(client)
    mlflow.set_experiment(experiment_name())
    return client


def of_server(server: str) -> "MlflowClient":
    """A client of a server of MLflow's, with the login that its own client knows.

    Raises:
        BadInput: when it does not answer, or not to this login.
    """
    os.environ.setdefault("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "3")  # some 15 s, then it is said
    import mlflow
    from mlflow.exceptions import MlflowException

    mlflow.set_tracking_uri(server)
    mlflow.set_registry_uri(server)
    client = mlflow.MlflowClient(tracking_uri=server, registry_uri=server)
    try:
        client.search_registered_models(max_results=1)
    except MlflowException as error:
        do = "Set MLFLOW_TRACKING_USERNAME and MLFLOW_TRACKING_PASSWORD, or put them into ~/.mlflow/credentials."
        raise BadInput(server, "MLflow's server, and a login that it knows", str(error)[:200], do) from None
    return client


def _make_experiment(client: "MlflowClient") -> None:
    name = experiment_name()
    if client.get_experiment_by_name(name) is None:
        client.create_experiment(name, f"{SCHEME}:/runs", {"mlflow.experimentKind": "custom_model_development"})


def experiment_name() -> str:
    """The workspace's name: its folder's."""
    return Path.cwd().name


def ensure_database(folder: Path) -> None:
    """See that `folder` holds a whole database of the installed MLflow; one process makes it, others wait for it.

    Raises:
        BadInput: for one that MLflow can do nothing with.
    """

    def update(path: Path) -> None:
        from mlflow.db import upgrade

        _quiet()
        assert upgrade.callback is not None
        upgrade.callback(f"sqlite:///{path}")

    with _locked(folder):
        ensure(folder / DATABASE, "mlflow", update)


def _quiet() -> None:
    for name in ("mlflow", "alembic"):
        logging.getLogger(name).setLevel(logging.WARNING)


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    with (folder / "mlflow.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _serve_artifacts_locally() -> None:
    """Let this process read and write `mlflow-artifacts:` addresses, which the server keeps in the same folder."""
    from mlflow.store.artifact.artifact_repository_registry import _artifact_repository_registry
    from mlflow.store.artifact.local_artifact_repo import LocalArtifactRepository

    root = (SERVERS / "artifacts").resolve()
    root.mkdir(exist_ok=True)

    class Proxied(LocalArtifactRepository):
        def __init__(self, artifact_uri: str, *args: Any, **kwargs: Any) -> None:
            inside = artifact_uri.removeprefix(f"{SCHEME}:").lstrip("/")
            super().__init__(str(root / inside))

    _artifact_repository_registry.register(SCHEME, Proxied)


def _store_artifacts_in(own: MlflowLab) -> None:
    """Let this process read and write `mlflow-artifacts:` addresses, which the server keeps in the same S3 folder."""
    from mlflow.store.artifact.artifact_repository_registry import _artifact_repository_registry
    from mlflow.store.artifact.s3_artifact_repo import S3ArtifactRepository

    if own.s3_endpoint:
        os.environ["MLFLOW_S3_ENDPOINT_URL"] = own.s3_endpoint

    class Stored(S3ArtifactRepository):
        def __init__(self, artifact_uri: str, *args: Any, **kwargs: Any) -> None:
            inside = artifact_uri.removeprefix(f"{SCHEME}:").lstrip("/")
            super().__init__(f"{own.artifacts.rstrip('/')}/{inside}", *args, **kwargs)

    _artifact_repository_registry.register(SCHEME, Stored)
