"""Writes a run's tables into the registry of the working folder, with the hashes of all that they were made from."""

import json
from collections.abc import Iterator
from pathlib import Path

from benchmarks.method.settings import Method
from bumblebee.errors import BadInput
from tasks.lineage import path_hash
from tasks.registry import log_run

PATTERNS = (
    "study.json",
    "policy.pt",
    "delta.pt",
    "card.json",
    "diagnosis.json",
    "effects.yaml",
    "errors.csv",
    "tried-*.csv",
    "sealed-*.csv",
    "record-*",
)
"""Files and folders of a run that its tables depend on."""


def record(run: Path, table: Path, method: Method, stamp: str, metrics: dict[str, float]) -> str:
    """Write `table` and the hashes, which come to lie beside it, as one run; its id in MLflow.

    Args:
        run: the run's folder.
        table: Markdown file below the folder one stands in.
        method: the settings.
        stamp: hash of what the run was held to.
        metrics: name -> value.

    Raises:
        BadInput: if the table lies elsewhere, where the registry has no name for it.
    """
    here = Path.cwd()
    if not table.resolve().is_relative_to(here):
        raise BadInput("--out", f"a file below {here}", str(table), "Leave --record out, or write the table here.")
    own = table.resolve().relative_to(here)
    listed = own.with_suffix(".json")
    listed.write_text(json.dumps(dict(hashes(run)), indent=1) + "\n")
    tags = {"settings": stamp, "run": str(run)}
    return log_run("method", None, None, method, metrics, None, tags, [own, listed])


def hashes(run: Path) -> Iterator[tuple[str, str]]:
    """Path below the run's folder, and hash, of all that its tables depend on."""
    for pattern in PATTERNS:
        for path in sorted(run.rglob(pattern)):
            yield path.relative_to(run).as_posix(), path_hash(path)
