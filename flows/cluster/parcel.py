"""Parcel of a stage for another machine: the code as it is here, settings, dvc.lock, files that no stage makes.

Everything else the machine pulls from DVC's shared remote.
"""

import io
import tarfile
from collections.abc import Iterable
from pathlib import Path

from tasks.lab.servers import FILE as LAB
from tasks.lab.servers import Lab

CODE = ("bumblebee", "tasks", "flows")
SETTINGS = ("dvc.yaml", "dvc.lock", "params.yaml", ".dvcignore", LAB)
LIMIT = 64 * 2**20  # [bytes] of plain inputs; a stage that reads more stays on the machine that has them
REMOTE = "lab"  # name of the remote in DVC's settings


def plain_inputs(deps: Iterable[str], outs: Iterable[str]) -> list[str]:
    """The dependencies that are neither code nor made by a stage.

    Args:
        deps: paths of one stage, as dvc.yaml has them.
        outs: paths that all stages make.
    """
    made = list(outs)
    return [dep for dep in deps if dep.split("/")[0] not in CODE and not any(_overlap(dep, out) for out in made)]


def _overlap(one: str, other: str) -> bool:
    return f"{one}/".startswith(f"{other}/") or f"{other}/".startswith(f"{one}/")


def size(workspace: Path, inputs: Iterable[str]) -> int:
    """Bytes of the files under these paths."""
    roots = [workspace / name for name in inputs]
    files = (file for root in roots for file in ([root] if root.is_file() else root.rglob("*")))
    return sum(file.stat().st_size for file in files if file.is_file())


def dvc_settings(lab: Lab) -> str:
    """`.dvc/config` of a work tree without git whose default remote is the lab's; nothing secret."""
    assert lab.ray is not None
    lines = [
        "[core]",
        "    analytics = false",
        "    check_update = false",
        "    no_scm = True",
        f"    remote = {REMOTE}",
    ]
    lines += [f"['remote \"{REMOTE}\"']", f"    url = {lab.ray.remote}"]
    if lab.ray.remote.startswith("s3://") and lab.mlflow.s3_endpoint:
        lines.append(f"    endpointurl = {lab.mlflow.s3_endpoint}")
    return "\n".join(lines) + "\n"


def pack(workspace: Path, inputs: Iterable[str], settings: str) -> bytes:
    """A tar file of the workspace's code and settings and of `inputs`; DVC's lock is held, so that dvc.lock is whole.

    Args:
        workspace: folder of the head; its code may be linked.
        inputs: further paths in it; those that are not there are left out, and the stage says so.
        settings: text of `.dvc/config`.
    """
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w", dereference=True) as packed:
        for name in (*CODE, *SETTINGS, *inputs):
            if (workspace / name).exists():
                packed.add(workspace / name, name, filter=_without_caches)
        entry = tarfile.TarInfo(".dvc/config")
        entry.size, entry.mode = len(settings.encode()), 0o600
        packed.addfile(entry, io.BytesIO(settings.encode()))
    return stream.getvalue()


def _without_caches(entry: tarfile.TarInfo) -> tarfile.TarInfo | None:
    return None if entry.name.endswith((".pyc", "__pycache__")) else entry
