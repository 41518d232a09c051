"""The one module that knows MLflow: runs with what they were made from, models with their aliases.

Runs and models are written straight into the workspace's database and artifact folder, so that plain `dvc repro`
and the flow leave the same history; the server only shows it. Why: docs/decisions/mlflow-store.md.
"""

import csv
import fcntl
import json
import logging
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, is_dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tasks.lineage import current_inputs, git_sha, upstream

if TYPE_CHECKING:
    from mlflow import MlflowClient

SERVERS = Path(".servers")
SCHEME = "mlflow-artifacts"
LONGEST = 480  # characters of a parameter or a tag that are kept


def prepare() -> "MlflowClient":
    """A client on the workspace's own database, which is made first if need be, by one process at a time."""
    return _prepared(Path.cwd())


@cache
def _prepared(workspace: Path) -> "MlflowClient":
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    os.environ.setdefault("MLFLOW_SUPPRESS_PRINTING_URL_TO_STDOUT", "1")
    logging.getLogger("mlflow").setLevel(logging.WARNING)
    import mlflow

    SERVERS.mkdir(exist_ok=True)
    uri = f"sqlite:///{(SERVERS / 'mlflow.db').resolve()}"
    logging.getLogger("mlflow").setLevel(logging.WARNING)
    logging.getLogger("alembic").setLevel(logging.WARNING)
    with _locked():
        mlflow.set_tracking_uri(uri)
        mlflow.set_registry_uri(uri)
        _serve_artifacts_locally()
        client = mlflow.MlflowClient(tracking_uri=uri, registry_uri=uri)
        name = experiment_name()
        if client.get_experiment_by_name(name) is None:
            client.create_experiment(name, artifact_location=f"{SCHEME}:/runs")
    mlflow.set_experiment(name)
    return client


def experiment_name() -> str:
    """The workspace's name: its folder's."""
    return Path.cwd().name


@contextmanager
def _locked() -> Iterator[None]:
    with (SERVERS / "mlflow.lock").open("w") as lock:
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


def log_run(
    stage: str,
    cluster: str | None,
    round: int | None,
    params: object,
    metrics: dict[str, float],
    curve: Path | None,
    artifacts: list[Path],
    tags: dict[str, str],
) -> str:
    """Write one finished run; returns its id."""
    from mlflow.entities import Metric, Param, RunTag

    client = prepare()
    experiment = client.get_experiment_by_name(experiment_name())
    assert experiment is not None
    title = " ".join(str(part) for part in (stage, cluster, f"r{round}" if round is not None else None) if part)
    run = client.create_run(experiment.experiment_id, run_name=title)
    run_id, now = run.info.run_id, run.info.start_time
    labels = {"stage": stage, **run_tags(), **tags}
    labels |= {key: str(value) for key, value in (("cluster", cluster), ("round", round)) if value is not None}
    points = [Metric(metric_name(name), float(value), now, 0) for name, value in metrics.items()]
    points += [Metric(metric_name(name), value, now, step) for name, step, value in read_curve(curve)] if curve else []
    settings = [Param(key, value[:LONGEST]) for key, value in flatten(params).items()]
    written = [RunTag(key, str(value)[:LONGEST]) for key, value in labels.items()]
    for start in range(0, max(len(points), 1), 1000):
        client.log_batch(run_id, metrics=points[start : start + 1000])
    for start in range(0, len(settings), 100):
        client.log_batch(run_id, params=settings[start : start + 100])
    for start in range(0, len(written), 100):
        client.log_batch(run_id, tags=written[start : start + 100])
    for artifact in artifacts:
        if artifact.is_dir():
            client.log_artifacts(run_id, str(artifact), artifact.name)
        elif artifact.exists():
            client.log_artifact(run_id, str(artifact))
    client.set_terminated(run_id)
    return str(run_id)


def metric_name(name: str) -> str:
    """A name that MLflow accepts: no empty part between slashes, no sign it does not know."""
    parts = (re.sub(r"[^\w.\- ]", "_", part).strip() or "unknown" for part in name.split("/"))
    return "/".join(parts)


def run_tags() -> dict[str, str]:
    """What this stage was made from, as tags: `git_sha` and `dvc.<path>` = hash of each of its inputs."""
    inputs = {f"dvc.{name.replace(':', '.')}": value for name, value in current_inputs().items()}
    return {"git_sha": git_sha(), "dvc_stage": os.environ.get("DVC_STAGE", ""), **inputs}


def flatten(params: object, prefix: str = "") -> dict[str, str]:
    """Nested settings as `a.b` -> text."""
    if params is None:
        return {}
    values = asdict(params) if is_dataclass(params) and not isinstance(params, type) else params
    if not isinstance(values, Mapping):
        return {prefix.rstrip("."): str(values)}
    flat: dict[str, str] = {}
    for key, value in values.items():
        nested = isinstance(value, Mapping) or is_dataclass(value)
        flat |= flatten(value, f"{prefix}{key}.") if nested else {f"{prefix}{key}": str(value)}
    return flat


def read_curve(path: Path) -> list[tuple[str, int, float]]:
    """(name, step, value) of each number in a CSV file whose first column is the step."""
    points = []
    with path.open(newline="") as file:
        for row in csv.DictReader(file):
            columns = list(row.items())
            step = int(float(columns[0][1]))
            for name, text in columns[1:]:
                try:
                    points.append((name, step, float(text)))
                except (TypeError, ValueError):
                    continue
    return [point for point in points if point[2] == point[2]]


def register(name: str, folder: Path, tags: dict[str, str], metrics: dict[str, float | None]) -> str:
    """A new version of the model `name` from a policy folder, with its contract; returns the version's number.

    The version is a plain ONNX model (MLflow's onnx flavour) with contract.json and card.json beside it. A version of
    the same file under the same evaluation is not made twice.
    """
    import mlflow

    client = prepare()
    same = ("onnx_sha256", "evaluation_contract", "dvc_policy")
    for version in _versions(client, name):
        if all(version.tags.get(key) == tags.get(key) for key in same):
            return str(version.version)
    made_from = {f"dvc.{path.replace(':', '.')}": value for path, value in upstream(folder).items()}
    with mlflow.start_run(run_name=f"publish {tags.get('policy', name)}", tags={"stage": "publish", **_short(tags)}):
        logged = _log_onnx(folder, name)
        mlflow.set_tags(_short(run_tags()))
        mlflow.log_metrics({key: value for key, value in metrics.items() if value is not None})
        for extra in ("contract.json", "card.json", "curve.csv"):
            if (folder / extra).exists():
                mlflow.log_artifact(str(folder / extra), "policy")
    # With its tags from the first moment: one set at a time, hundreds take MLflow half a minute.
    made = mlflow.register_model(logged.model_uri, name, tags=_short({**run_tags(), **made_from, **tags}))
    return str(made.version)


def _log_onnx(folder: Path, name: str) -> Any:
    import mlflow
    import numpy as np
    import onnx

    model = onnx.load(str(folder / "policy.onnx"))
    size = model.graph.input[0].type.tensor_type.shape.dim[1].dim_value
    return mlflow.onnx.log_model(
        onnx_model=model,
        name=name,
        onnx_execution_providers=["CPUExecutionProvider"],
        input_example=np.zeros((1, size), np.float32),
        pip_requirements=["onnxruntime", "numpy"],  # named: to find them out takes MLflow many seconds
        metadata={"contract": json.loads((folder / "contract.json").read_text())},
    )


def set_alias(name: str, alias: str, version: str) -> None:
    """Let `models:/name@alias` mean this version."""
    prepare().set_registered_model_alias(name, alias, version)


def champion_version(name: str) -> str | None:
    """The version that `models:/name@champion` means, or None."""
    found = _champion(name)
    return None if found is None else str(found.version)


def champion_tags(name: str) -> dict[str, str] | None:
    """The tags of the champion's version, or None where there is no champion."""
    found = _champion(name)
    return None if found is None else dict(found.tags)


def _champion(name: str) -> Any:
    from mlflow.exceptions import MlflowException

    try:
        return prepare().get_model_version_by_alias(name, "champion")
    except MlflowException:
        return None


def _versions(client: "MlflowClient", name: str) -> list[Any]:
    return list(client.search_model_versions(f"name = '{name}'"))


def _short(tags: Mapping[str, str]) -> dict[str, str]:
    return {key: str(value)[:LONGEST] for key, value in tags.items()}
