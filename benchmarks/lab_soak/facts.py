"""Facts of a finished loop: the hashes of its files without wall times, and its runs in MLflow's database."""

import csv
import hashlib
import io
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import sqlalchemy
import yaml

from tasks.lab.checks import s3_client
from tasks.lab.servers import Lab, read_lab

TIMES = {"seconds", "frames_per_second"}  # of a policy's card and curve
HISTORY = {"version", "versions", "champion", "promoted", "reason"}  # of published.json: what was there before
LINEAGE = "lineage.json"

RUNS = """SELECT r.run_uuid, r.name, r.status, r.artifact_uri,
 (SELECT count(*) FROM params p WHERE p.run_uuid = r.run_uuid),
 (SELECT count(*) FROM metrics m WHERE m.run_uuid = r.run_uuid)
 FROM runs r JOIN experiments e ON e.experiment_id = r.experiment_id WHERE e.name = :name
 AND r.lifecycle_stage = 'active' ORDER BY r.start_time"""
TAGS = "SELECT key, value FROM tags WHERE run_uuid = :run AND key IN ('stage', 'dvc_stage', 'git_sha', 'lineage')"
VERSIONS = "SELECT name, version, status FROM model_versions WHERE run_id = :run"


def of(workspace: Path, address: str) -> dict[str, Any]:
    """Stages, files and runs of a workspace.

    Args:
        workspace: a finished one; its name is the experiment's.
        address: of MLflow's database, as SQLAlchemy takes it.
    """
    stages = yaml.safe_load((workspace / "dvc.lock").read_text())["stages"]
    outs = [out["path"] for stage in stages.values() for out in stage["outs"]]
    return {"stages": sorted(stages), "files": hashes(workspace, outs), "runs": runs(workspace, address)}


def hashes(workspace: Path, outs: Iterable[str]) -> dict[str, str]:
    """Path -> hash of each file that a stage made."""
    found = {}
    for out in outs:
        place = workspace / out
        for file in [place] if place.is_file() else sorted(place.rglob("*")):
            if file.is_file():
                name = str(file.relative_to(workspace))
                found[name] = hashlib.md5(timeless(name, file.read_bytes())).hexdigest()
    return found


def timeless(name: str, content: bytes) -> bytes:
    """A file without what no two runs agree on: how long a training took, and the registry's numbers of versions."""
    file = name.rpartition("/")[2]
    if file == "card.json":
        card = json.loads(content)
        return _json({key: card[key] for key in card if key not in TIMES})
    if file == "curve.csv":
        rows = csv.DictReader(io.StringIO(content.decode()))
        return _json([{key: row[key] for key in row if key not in TIMES} for row in rows])
    if file == "published.json":
        table = json.loads(content)
        models = table["models"].items()
        kept = {model: {key: own[key] for key in own if key not in HISTORY} for model, own in models}
        return _json({**table, "models": kept})
    return content


def _json(value: object) -> bytes:
    return json.dumps(value, sort_keys=True).encode()


def runs(workspace: Path, address: str) -> list[dict[str, Any]]:
    """Every run of the workspace's experiment: what it is, how much it holds, and whether its lineage is whole."""
    engine = sqlalchemy.create_engine(address)
    store = Store(workspace, read_lab(workspace))
    found = []
    with engine.connect() as database:
        rows = database.execute(sqlalchemy.text(RUNS), {"name": workspace.name}).fetchall()
        for run, name, status, where, params, points in rows:
            tags = dict(database.execute(sqlalchemy.text(TAGS), {"run": run}).tuples().all())
            made = database.execute(sqlalchemy.text(VERSIONS), {"run": run}).fetchall()
            files = store.files(where)
            whole = LINEAGE in files and hashlib.sha256(store.read(where, LINEAGE)).hexdigest() == tags.get("lineage")
            facts = {"name": name, "run": run, "status": status, "params": params, "points": points}
            facts |= {"files": files, "lineage": whole, "git_sha": tags.get("git_sha"), "stage": tags.get("dvc_stage")}
            found.append({**facts, "versions": [f"{model} {state}" for model, _, state in made]})
    engine.dispose()
    return found


class Store:
    """Files of runs, in the workspace or in the lab's bucket."""

    def __init__(self, workspace: Path, lab: Lab | None) -> None:
        self.root, self.lab = workspace / ".servers" / "artifacts", lab
        self.client = None if lab is None else s3_client(lab.mlflow)

    def files(self, where: str) -> list[str]:
        """Names of a run's files, which `where` (`mlflow-artifacts:/...`) holds."""
        inside = urlsplit(where).path.strip("/")
        if self.lab is None:
            place = self.root / inside
            return sorted(str(file.relative_to(place)) for file in place.rglob("*") if file.is_file())
        own = self.lab.mlflow
        prefix = f"{own.folder}/{inside}/"
        assert self.client is not None
        pages = self.client.get_paginator("list_objects_v2").paginate(Bucket=own.bucket, Prefix=prefix)
        return sorted(item["Key"].removeprefix(prefix) for page in pages for item in page.get("Contents", []))

    def read(self, where: str, name: str) -> bytes:
        """One of them."""
        inside = urlsplit(where).path.strip("/")
        if self.lab is None:
            return (self.root / inside / name).read_bytes()
        own = self.lab.mlflow
        assert self.client is not None
        key = f"{own.folder}/{inside}/{name}"
        return bytes(self.client.get_object(Bucket=own.bucket, Key=key)["Body"].read())
