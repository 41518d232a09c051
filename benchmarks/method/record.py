"""Writes a run's tables into the registry of the working folder, with the hashes of all that they were made from."""

import json
from collections.abc import Iterator
from pathlib import Path

from benchmarks.method.settings import Method
from bumblebee.errors import BadInput
from bumblebee.io.write import write_file
from tasks.registry import log_run
from tasks.running.lineage import path_hash

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


def below_here(table: Path) -> Path:
    """The table as the registry names it, from the working folder.

    Raises:
        BadInput: if it lies elsewhere, where the registry has no name for it.
    """
    here = Path.cwd()
    if not table.resolve().is_relative_to(here):
        raise BadInput("--out", f"a file below {here}", str(table), "Leave --record out, or write the table here.")
    return table.resolve().relative_to(here)


def record(run: Path, table: Path, method: Method, stamp: str, metrics: dict[str, float]) -> str:
    """Write the table and the hashes, which come to lie beside it, as one run; its id in MLflow.

    Args:
        run: the run's folder.
        table: `below_here`.
        method: the settings.
        stamp: hash of what the run was held to.
        metrics: name -> value.
    """
    listed = table.with_name(f"{table.name}.hashes.json")
    write_file(listed, json.dumps(dict(hashes(run)), indent=1) + "\n")
    return log_run("method", None, None, method, metrics, None, {"settings": stamp}, [table, listed])


def hashes(run: Path) -> Iterator[tuple[str, str]]:
    """Path below the run's folder, and hash, of all that its tables depend on."""
    for pattern in PATTERNS:
        for path in sorted(run.rglob(pattern)):
            yield path.relative_to(run).as_posix(), path_hash(path)
