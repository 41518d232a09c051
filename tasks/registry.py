"""The one module that knows MLflow: runs with what they were made from, models with their aliases.

Runs and models are written straight into the database and store of the workspace, or of its lab (`lab.yaml`), so that
plain `dvc repro` and the flow leave the same history; the server only shows it. Why: docs/decisions/mlflow-store.md.
Where `lab.yaml` names nothing but `tracking`, a lab's server, all goes through that, under the login of who works here.
"""

import fcntl
import hashlib
import json
import logging
import os
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bumblebee.errors import BadInput
from tasks.database import ensure
from tasks.lab import MlflowLab, read_lab
from tasks.lab_checks import one_at_a_time
from tasks.lab_serve import read_tracking
from tasks.lineage import current_stage, git_sha, history, inputs_of_stage, lineage, place
from tasks.outputs import MANIFEST, copied, manifest
from tasks.private import private
from tasks.run_form import Metric, by_step, card_settings, fitted, flatten, metric_name, read_curve

if TYPE_CHECKING:
    from mlflow import MlflowClient

# Before anything of MLflow is imported: it reads this once, and would otherwise tell its maker of every use.
NO_TELEMETRY = "MLFLOW_DISABLE_TELEMETRY"
os.environ.setdefault(NO_TELEMETRY, "true")

SERVERS, DATABASE = Path(".servers"), "mlflow.db"
SCHEME = "mlflow-artifacts"
# Characters that MLflow's tables hold; what is longer says so there and is whole in the file that it names.
LONGEST_PARAM, LONGEST_TAG, LONGEST_DESCRIPTION = 6000, 5000, 5000
LINEAGE, CARD = "lineage.json", "README.md"
POLICY_FILES = ("policy.onnx", "contract.json", "card.json", "curve.csv")
EXTRA = "extra_files"  # MLflow's own name of the folder for files beside a model


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
            client = _of_server(server)
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


def _of_server(server: str) -> "MlflowClient":
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


def log_run(
    stage: str,
    cluster: str | None,
    round: int | None,
    params: object,
    metrics: Mapping[str, Metric],
    curve: Path | None,
    tags: dict[str, str],
    outputs: Sequence[Path] | None = None,
    begun: float | None = None,
) -> str:
    """Write one finished run with its outputs (`tasks/outputs.py`); returns its id.

    Args:
        stage: the stage's name.
        cluster: the cluster, where the stage has one.
        round: the round, where the stage has one.
        params: the configuration (dataclass or mapping).
        metrics: numbers, each alone or by step.
        curve: a CSV file whose first column is the step.
        tags: anything else worth searching for.
        outputs: files and folders, relative to the workspace; None: those of the stage that DVC runs.
        begun: when the stage began, in seconds since 1970; None: now.

    A stage that DVC runs again with equal inputs, as after a kill, takes the place of what it has written before.
    """
    from mlflow.entities import Metric as Point
    from mlflow.entities import Param, RunTag

    client = prepare()
    experiment = client.get_experiment_by_name(experiment_name())
    assert experiment is not None
    title = " ".join(str(part) for part in (stage, cluster, f"r{round}" if round is not None else None) if part)
    settings_of = flatten(params)
    origin = _text(lineage(inputs_of_stage(), settings_of, settings_of.get("seed")))
    record = hashlib.sha256(f"{place()} {title} {origin}".encode()).hexdigest()
    if "DVC_STAGE" in os.environ:
        for earlier in client.search_runs([experiment.experiment_id], f"tags.record = '{record}'"):
            client.delete_run(earlier.info.run_id)
    now = time.time()
    start, end = (int(1000 * moment) for moment in (now if begun is None else begun, now))
    run = client.create_run(experiment.experiment_id, start, run_name=title, tags={"record": record})
    run_id = run.info.run_id
    labels = {"stage": stage, **_origin_tags(origin), **tags}
    labels |= {key: str(value) for key, value in (("cluster", cluster), ("round", round)) if value is not None}
    numbers = [*by_step(metrics), *(read_curve(curve) if curve else [])]
    points = [Point(metric_name(name), value, end, step) for name, step, value in numbers]
    settings = [Param(key, fitted(value, LONGEST_PARAM, LINEAGE)) for key, value in settings_of.items()]
    written = [RunTag(key, value) for key, value in _fitted_tags(labels).items()]
    for kind, entries, most in (("metrics", points, 1000), ("params", settings, 100), ("tags", written, 100)):
        for first in range(0, len(entries), most):
            client.log_batch(run_id, **{kind: entries[first : first + most]})
    client.log_text(run_id, origin, LINEAGE)
    made = manifest(current_stage()[1] if outputs is None else outputs)
    client.log_text(run_id, _text(made), MANIFEST)
    for file in copied(made):
        client.log_artifact(run_id, str(file), os.path.dirname(file))
    client.set_terminated(run_id, end_time=end)
    return str(run_id)


def _origin_tags(origin: str) -> dict[str, str]:
    """Tags to filter runs by: commit, DVC's stage, and the hash of all inputs, which are in lineage.json."""
    digest = hashlib.sha256(origin.encode()).hexdigest()
    return {"git_sha": git_sha(), "dvc_stage": os.environ.get("DVC_STAGE", ""), "lineage": digest}


def _fitted_tags(tags: Mapping[str, object]) -> dict[str, str]:
    return {key: fitted(str(value), LONGEST_TAG, LINEAGE) for key, value in tags.items()}


def _text(content: Mapping[str, Any]) -> str:
    return json.dumps(content, indent=1) + "\n"


def register(name: str, folder: Path, tags: dict[str, str], metrics: dict[str, float | None], card: str = "") -> str:
    """A new version of the model `name` from a policy folder; returns the version's number.

    The version is a plain ONNX model (MLflow's onnx flavour) with its signature; beside it in `extra_files` lie the
    policy's own files, its card and lineage.json. A version of the same file under the same evaluation is not made
    twice.

    Args:
        name: the registered model.
        folder: the exported policy.
        tags: by which versions are compared and told apart.
        metrics: numbers; None where there is none.
        card: Markdown for the version's page.
    """
    import mlflow

    client = prepare()
    same = ("onnx_sha256", "evaluation_contract", "dvc_policy")
    for version in _versions(client, name):
        if all(version.tags.get(key) == tags.get(key) for key in same):
            if card and not version.description:  # made before versions had cards
                client.update_model_version(name, version.version, fitted(card, LONGEST_DESCRIPTION, CARD))
            return str(version.version)
    settings = card_settings(folder)
    origin = _text(lineage(history(folder), {**settings, **tags}, settings.get("seed")))
    labels = {"stage": "publish", **_origin_tags(origin)}
    policy = tags.get("policy", name)
    with mlflow.start_run(run_name=f"publish {policy}", tags={"policy": policy, **labels}, description=card or None):
        logged = _log_onnx(folder, name, {LINEAGE: origin, CARD: card})
        mlflow.log_metrics({key: value for key, value in metrics.items() if value is not None})
        mlflow.log_text(origin, LINEAGE)
        mlflow.log_text(card, CARD)
    made = mlflow.register_model(logged.model_uri, name, tags=_fitted_tags({**labels, **tags}))
    if card:
        client.update_model_version(name, made.version, fitted(card, LONGEST_DESCRIPTION, CARD))
    return str(made.version)


def _log_onnx(folder: Path, name: str, texts: Mapping[str, str]) -> Any:
    import mlflow
    import onnx

    model = onnx.load(str(folder / "policy.onnx"))
    with tempfile.TemporaryDirectory() as made:
        files = [str(folder / file) for file in POLICY_FILES if (folder / file).exists()]
        for file, text in texts.items():
            (Path(made) / file).write_text(text)
            files.append(str(Path(made) / file))
        return mlflow.onnx.log_model(
            onnx_model=model,
            name=name,
            onnx_execution_providers=["CPUExecutionProvider"],
            signature=_signature(model),
            pip_requirements=["onnxruntime", "numpy"],  # named: to find them out takes MLflow many seconds
            metadata={"contract": json.loads((folder / "contract.json").read_text())},
            extra_files=files,
        )


def _signature(model: Any) -> Any:
    """Names, shapes and types of the graph's ends; -1 for any number of robots."""
    import numpy as np
    from mlflow.models import ModelSignature
    from mlflow.types import Schema, TensorSpec

    def schema(values: Any) -> Any:
        sizes = [[d.dim_value or -1 for d in value.type.tensor_type.shape.dim] for value in values]
        return Schema([TensorSpec(np.dtype("float32"), tuple(s), v.name) for v, s in zip(values, sizes, strict=True)])

    return ModelSignature(inputs=schema(model.graph.input), outputs=schema(model.graph.output))


def describe(name: str, text: str) -> None:
    """Set the text on the page of the registered model."""
    prepare().update_registered_model(name, fitted(text, LONGEST_DESCRIPTION, CARD))


def fetch(name: str, wanted: str, out: Path, server: str = "") -> Path:
    """Copy a version's files from the store of the workspace in this folder, or from a server.

    Args:
        name: the registered model.
        wanted: an alias such as "champion", or a version's number.
        out: a folder that is not there yet.
        server: its address; without, no server is needed.

    Raises:
        BadInput: where there is no store or server, no such version, or something at `out`.
    """
    import mlflow
    from mlflow.exceptions import MlflowException

    here = not server and read_lab(Path.cwd()) is None and read_tracking(Path.cwd()) is None
    if here and not (SERVERS / DATABASE).exists():
        raise BadInput(Path.cwd() / SERVERS / DATABASE, "a workspace's registry", "no file", "Give its --workspace.")
    if out.exists():
        raise BadInput(out, "a new folder", "one that exists", "Choose another --out.")
    client = _of_server(server) if server else prepare()
    try:
        numbered = wanted.isdecimal()
        found = client.get_model_version(name, wanted) if numbered else client.get_model_version_by_alias(name, wanted)
    except MlflowException:
        known = ", ".join(model.name for model in client.search_registered_models()) or "none"
        where = server or "this workspace's registry"
        raise BadInput(f"{name}@{wanted}", f"a version in {where}", f"models: {known}") from None
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out.parent) as made:
        whole = Path(mlflow.artifacts.download_artifacts(f"models:/{name}/{found.version}", dst_path=made))
        _policy_files(whole).rename(out)
    return out


def _policy_files(whole: Path) -> Path:
    """The policy's own folder in a version's files; from before there is MLflow's model alone, of other bytes."""
    if (whole / EXTRA).is_dir():
        return whole / EXTRA
    import onnx
    import yaml

    (folder := whole / "policy").mkdir()
    model = onnx.load(str(whole / "model.onnx")).SerializeToString()  # with the weights beside it
    (folder / "policy.onnx").write_bytes(model)
    contract = yaml.safe_load((whole / "MLmodel").read_text())["metadata"]["contract"]
    contract |= {"onnx_sha256": hashlib.sha256(model).hexdigest(), "exported_onnx_sha256": contract["onnx_sha256"]}
    (folder / "contract.json").write_text(_text(contract))
    return folder


def set_alias(name: str, alias: str, version: str) -> None:
    """Let `models:/name@alias` mean this version."""
    prepare().set_registered_model_alias(name, alias, version)


def champion_version(name: str) -> str | None:
    """The version that `models:/name@champion` means, or None."""
    found = _champion(name)
    return None if found is None else str(found.version)


def version_tags(name: str, version: str) -> dict[str, str] | None:
    """The tags of a version, or None where there is none."""
    found = _version(name, version)
    return None if found is None else dict(found.tags)


def version_card(name: str, version: str) -> str:
    """Text on the page of a version."""
    found = _version(name, version)
    return "" if found is None else str(found.description or "")


def _version(name: str, version: str) -> Any:
    from mlflow.exceptions import MlflowException

    try:
        return prepare().get_model_version(name, version)
    except MlflowException:
        return None


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
