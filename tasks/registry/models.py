"""Registered models: versions with their files, tags and aliases."""

import hashlib
import json
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bumblebee.errors import BadInput
from tasks.lab.serve import read_tracking
from tasks.lab.servers import read_lab
from tasks.registry.labels import CARD, LINEAGE, LONGEST_DESCRIPTION, as_text, fitted_tags, origin_tags
from tasks.registry.store import DATABASE, SERVERS, of_server, prepare
from tasks.running.lineage import history, lineage
from tasks.running.run_form import card_settings, fitted

if TYPE_CHECKING:
    from mlflow import MlflowClient

POLICY_FILES = ("policy.onnx", "contract.json", "card.json", "curve.csv")
EXTRA = "extra_files"  # MLflow's own name of the folder for files beside a model


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
    origin = as_text(lineage(history(folder), {**settings, **tags}, settings.get("seed")))
    labels = {"stage": "publish", **origin_tags(origin)}
    policy = tags.get("policy", name)
    with mlflow.start_run(run_name=f"publish {policy}", tags={"policy": policy, **labels}, description=card or None):
        logged = _log_onnx(folder, name, {LINEAGE: origin, CARD: card})
        mlflow.log_metrics({key: value for key, value in metrics.items() if value is not None})
        mlflow.log_text(origin, LINEAGE)
        mlflow.log_text(card, CARD)
    made = mlflow.register_model(logged.model_uri, name, tags=fitted_tags({**labels, **tags}))
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


NO_WORKSPACE = "No loop has run there; --workspace takes the folder of one that has: runs/NAME, or the checkout."


def fetch(
    name: str, wanted: str, out: Path, server: str = "", check: Callable[[Path], None] = lambda folder: None
) -> Path:
    """Copy a version's files from the store of the workspace in this folder, or from a server.

    Args:
        name: the registered model.
        wanted: an alias such as "champion", or a version's number.
        out: a folder that is not there yet.
        server: its address; without, no server is needed.
        check: called with the policy's files before they lie at `out`; what it raises leaves nothing there.

    Raises:
        BadInput: where there is no store or server, no such version, or something at `out`.
    """
    import mlflow
    from mlflow.exceptions import MlflowException

    here = not server and read_lab(Path.cwd()) is None and read_tracking(Path.cwd()) is None
    if here and not (SERVERS / DATABASE).exists():
        raise BadInput(Path.cwd() / SERVERS / DATABASE, "a workspace's registry", "no file", NO_WORKSPACE)
    if out.exists():
        raise BadInput(out, "a new folder", "one that exists", "Choose another --out.")
    client = of_server(server) if server else prepare()
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
        check(files := _policy_files(whole))
        files.rename(out)
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
    (folder / "contract.json").write_text(as_text(contract))
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
