"""Code that Ray runs on a machine of the cluster. It is sent by value: nothing of ours need be installed there.

So this module imports the standard library alone. The stage's code comes with its parcel (flows/cluster/parcel.py).
"""

import fcntl
import importlib.metadata
import importlib.util
import io
import os
import platform
import shutil
import socket
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterator
from pathlib import Path

PLACE = "BUMBLEBEE_NODE"  # variable of `ray start`: the machine's own folder for work trees and DVC's cache


def facts(packages: tuple[str, ...], folder: str, module: str) -> dict[str, str]:
    """Facts that must be equal on all machines, and what is wrong with the way to the shared remote ("" for nothing).

    Args:
        packages: names whose versions are asked for; "" in the answer where one is not installed.
        folder: of the remote, which must be writable here; "" for a remote that is no folder.
        module: that DVC needs for the remote; "" for none.
    """
    found = {"host": socket.gethostname(), "Python": platform.python_version(), "fault": ""}
    for name in packages:
        try:
            found[name] = importlib.metadata.version(name).partition("+")[0]
        except importlib.metadata.PackageNotFoundError:
            found[name] = ""
    if folder and not (os.path.isdir(folder) and os.access(folder, os.W_OK)):
        found["fault"] = f"no folder {folder} that may be written"
    if module and importlib.util.find_spec(module) is None:
        found["fault"] = f"no package {module.replace('_', '-')}"
    return found


def run(parcel: bytes, workspace: str, words: list[str], variables: dict[str, str]) -> Iterator[str | int]:
    """Unpack the parcel into a work tree of its own and run `python -m WORDS` there.

    Yields the machine's name, the lines that the program prints, and at last its exit status. The tree is removed.

    Args:
        parcel: as flows/cluster/parcel.py packs it.
        workspace: name of the tree's folder, after which MLflow's experiment is called.
        words: the module and its arguments.
        variables: beside those of this machine.
    """
    place = Path(os.environ.get(PLACE) or Path.home() / ".cache" / "bumblebee" / "node")
    (place / "trees").mkdir(parents=True, exist_ok=True)
    _clear(place / "trees")
    own = Path(tempfile.mkdtemp(dir=place / "trees"))
    with (own / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        tree = own / workspace
        yield f"on {socket.gethostname()}"
        try:
            with tarfile.open(fileobj=io.BytesIO(parcel)) as packed:
                packed.extractall(tree, filter="data")
            (tree / ".dvc" / "config.local").write_text(f"[cache]\n    dir = {place / 'cache'}\n")
            yield from _said([sys.executable, "-m", *words], tree, {**os.environ, **variables})
        finally:
            shutil.rmtree(own, ignore_errors=True)


def _said(command: list[str], tree: Path, variables: dict[str, str]) -> Iterator[str | int]:
    with subprocess.Popen(
        command, cwd=tree, env=variables, text=True, errors="replace",
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        for line in process.stdout:
            yield line.rstrip("\n")
        yield process.wait()


def _clear(trees: Path) -> None:
    """Remove the trees of stages that were killed: those whose lock nobody holds."""
    for own in trees.iterdir():
        try:
            with (own / "lock").open("r+") as lock:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(own, ignore_errors=True)
        except OSError:
            continue  # in use, or just being made
