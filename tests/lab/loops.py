"""A workspace with the smoke profile, on one machine or on a lab's, and what its loop made without the times in it."""

import hashlib
import io
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import yaml

from bumblebee.measured.metadata import METADATA_KEY
from flows import workspace as workspaces
from flows.environment import environment

LIMIT = 3600  # [s]
TIMED = (
    "data/rollouts",  # recorded_at of each
    "data/measured",  # the same files, accepted
    "data/approvals",  # when it was answered
    "data/gates",
    "reports/report.html",  # when it was written
)
"""Paths whose content says when it was made, which no two runs agree on."""
WHEN = re.compile(rb"20\d\d-\d\d-\d\d[T ]\d\d:\d\d(:\d\d)?(\+00:00| UTC)")
SHORT = 12  # signs of a hash that a page shows


def workspace(folder: Path, content: dict[str, Any] | None, **over: Any) -> Path:
    """The smoke profile; `content` is of lab.yaml, None for one machine."""
    made = workspaces.create(folder / "demo", "smoke", **over)
    if content is not None:
        (made / "lab.yaml").write_text(yaml.safe_dump(content))
    return made


def only(made: Path, *stages: str) -> Path:
    """The workspace with these stages alone."""
    pipeline = yaml.safe_load((made / "dvc.yaml").read_text())
    pipeline["stages"] = {name: pipeline["stages"][name] for name in stages}
    (made / "dvc.yaml").write_text(yaml.safe_dump(pipeline, sort_keys=False))
    return made


def call(folder: Path, *words: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """A program of ours in the workspace, to its end."""
    settings = {**environment(folder), **variables}
    command = [sys.executable, *words]
    return subprocess.run(command, cwd=folder, env=settings, capture_output=True, text=True, check=False, timeout=LIMIT)


def locked(folder: Path) -> dict[str, Any]:
    """The stages of dvc.lock."""
    return dict(yaml.safe_load((folder / "dvc.lock").read_text())["stages"])


def untimed(lock: dict[str, Any]) -> dict[str, Any]:
    """The lock without the hashes of `TIMED`."""
    return {
        name: {**stage, **{part: _untimed(stage[part]) for part in ("deps", "outs")}} for name, stage in lock.items()
    }


def _untimed(entries: list[dict[str, Any]]) -> list[Any]:
    return [entry["path"] if entry["path"].startswith(TIMED) else entry for entry in entries]


def files(folder: Path) -> dict[str, bytes]:
    """Files that stages made."""
    outs = [folder / out["path"] for stage in locked(folder).values() for out in stage["outs"]]
    found = [file for out in outs for file in ([out] if out.is_file() else out.rglob("*")) if file.is_file()]
    return {str(file.relative_to(folder)): file.read_bytes() for file in found}


def timeless(made: dict[str, bytes]) -> dict[str, object]:
    """Files by name without what says when they were made; those outside `TIMED` to the byte.

    A hash of a file of these that stands in another one is replaced by that file's name.
    """
    hashes = {hashlib.sha256(content).hexdigest().encode(): f"<{name}>".encode() for name, content in made.items()}
    return {name: _timeless(name, content, hashes) for name, content in made.items()}


def _timeless(name: str, content: bytes, hashes: dict[bytes, bytes]) -> object:
    if not name.startswith(TIMED):
        return hashlib.md5(content).hexdigest()
    if name.endswith(".parquet"):
        table = pq.read_table(io.BytesIO(content))
        about = json.loads(table.schema.metadata[METADATA_KEY])
        assert about.pop("recorded_at")
        return table.replace_schema_metadata(), about
    for digest, label in hashes.items():
        content = content.replace(digest, label).replace(digest[:SHORT], label)
    return WHEN.sub(b"<time>", content)


def colleague(folder: Path, made: Path) -> Path:
    """Another folder with the pipeline and its lock, and `dvc pull` there."""
    for name in ("dvc.yaml", "dvc.lock", "params.yaml", "lab.yaml", ".dvc/config", ".dvc/config.local"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(made / name, folder / name)
    pulled = call(folder, "-m", "dvc", "pull", "-q")
    assert pulled.returncode == 0, pulled.stderr
    return folder
