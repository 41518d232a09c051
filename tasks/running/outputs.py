"""Which files of a stage's outputs a run in MLflow holds as copies, and the manifest that lists all of them."""

from collections.abc import Iterable, Iterator
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from tasks.running import paths
from tasks.running.lineage import file_hashes, listing_hash

MANIFEST = "outputs.json"


def manifest(outputs: Iterable[Path]) -> dict[str, Any]:
    """The outputs with DVC's path and hash, and size, hash and whether it is copied of each file.

    Args:
        outputs: files and folders, relative to the workspace.
    """
    return {"schema": 1, "outputs": [_described(path) for path in outputs if path.exists()]}


def copied(table: dict[str, Any]) -> Iterator[Path]:
    """The files of a manifest that a run holds as copies."""
    for out in table["outputs"]:
        yield from (Path(out["path"]) / file["path"] for file in out["files"] if file["copied"])


def _described(path: Path) -> dict[str, Any]:
    hashes = file_hashes(path)
    files = [_file(path, inside, md5) for inside, md5 in hashes.items()]
    whole = listing_hash(hashes) if path.is_dir() else hashes[""]
    return {"path": path.as_posix(), "md5": whole, "bytes": sum(file["bytes"] for file in files), "files": files}


def _file(path: Path, inside: str, md5: str) -> dict[str, Any]:
    whole = path / inside
    listed = any(fnmatch(whole.as_posix(), pattern) for pattern in paths.LISTED)
    return {"path": inside, "md5": md5, "bytes": whole.stat().st_size, "copied": not listed}
