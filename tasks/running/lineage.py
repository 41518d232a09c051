"""Lineage of a stage: the MD5 of each of its inputs as DVC counts it, the git commit, the versions."""

import hashlib
import importlib.metadata
import json
import os
import platform
import socket
import subprocess
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from bumblebee import DISTRIBUTION
from tasks.running import lock_file

COMMIT = "BUMBLEBEE_COMMIT"  # variable
PLACE = "BUMBLEBEE_PLACE"  # variable


def path_hash(path: Path) -> str:
    """DVC's hash of a file or folder (`.dir` at the end for a folder); "missing" where there is none."""
    if path.is_dir():
        return listing_hash(file_hashes(path))
    return _file_md5(path) if path.is_file() else "missing"


def file_hashes(path: Path) -> dict[str, str]:
    """Path -> MD5 of each file in a folder, relative to it; of a single file the path is empty."""
    if path.is_file():
        return {"": _file_md5(path)}
    files = (file for file in path.rglob("*") if file.is_file() and "__pycache__" not in file.parts)
    return {inside: _file_md5(path / inside) for inside in sorted(file.relative_to(path).as_posix() for file in files)}


def listing_hash(hashes: Mapping[str, str]) -> str:
    """DVC's hash of a folder with these files."""
    listing = [{"md5": md5, "relpath": inside} for inside, md5 in sorted(hashes.items())]
    return hashlib.md5(json.dumps(listing, sort_keys=True).encode()).hexdigest() + ".dir"


def _file_md5(path: Path) -> str:
    digest = hashlib.md5()
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def stage_files(stage: str, root: Path = Path(".")) -> tuple[dict[str, str], tuple[Path, ...]]:
    """The inputs and outputs of a DVC stage.

    Returns:
        path -> hash of every dependency and `params:<section>` -> hash of its parameters; the paths of the outputs.
    """
    from dvc.dependency.param import ParamsDependency
    from dvc.repo import Repo

    lock_file.read_whole()
    found: dict[str, str] = {}
    outputs: tuple[Path, ...] = ()
    with Repo(str(root)) as repo:
        for loaded in repo.stage.load_all("dvc.yaml"):
            if loaded.addressing != stage:
                continue
            outputs = tuple(Path(str(out.def_path)) for out in loaded.outs)
            for dep in loaded.deps:
                if isinstance(dep, ParamsDependency):
                    for section, values in dep.read_params().items():
                        text = json.dumps(values, sort_keys=True, default=str)
                        found[f"params:{section}"] = hashlib.md5(text.encode()).hexdigest()
                else:
                    found[str(dep.def_path)] = path_hash(Path(dep.fs_path))
    return found, outputs


@cache
def current_stage() -> tuple[dict[str, str], tuple[Path, ...]]:
    """The inputs and outputs of the stage that DVC runs in this process; none when it was started by hand."""
    stage = os.environ.get("DVC_STAGE")
    return stage_files(stage) if stage else ({}, ())


def current_inputs() -> dict[str, str]:
    """The inputs alone."""
    return current_stage()[0]


def upstream(output: Path, lock: Path = lock_file.FILE) -> dict[str, str]:
    """Path -> hash of everything that `output` was made from, over all stages back to the first, by dvc.lock.

    Parameters are `params:<section>` -> hash of their values. Empty where DVC has not made the output.
    """
    return {entry["path"]: entry["md5"] for entry in history(output, lock)}


def history(output: Path, lock: Path = lock_file.FILE) -> list[dict[str, str]]:
    """History as a list of `path`, `md5` and, where a stage made it, `stage`."""
    stages = lock_file.locked_stages(lock)
    makers = {out["path"]: name for name, stage in stages.items() for out in stage.get("outs", [])}
    found: dict[str, dict[str, str]] = {}
    waiting = [output.as_posix()]
    while waiting:
        for name in _makers(waiting.pop(), makers):
            for dep in stages[name].get("deps", []):
                if dep["path"] not in found:
                    made_by = ", ".join(_makers(dep["path"], makers))
                    entry = {"path": dep["path"], "md5": str(dep.get("md5", "missing"))}
                    found[dep["path"]] = entry | ({"stage": made_by} if made_by else {})
                    waiting.append(dep["path"])
            for section, values in stages[name].get("params", {}).get("params.yaml", {}).items():
                text = json.dumps(values, sort_keys=True, default=str)
                entry = {"path": f"params:{section}", "md5": hashlib.md5(text.encode()).hexdigest()}
                found[entry["path"]] = entry
    return list(found.values())


def _makers(path: str, makers: Mapping[str, str]) -> list[str]:
    """The stage that makes `path` or a folder around it, else all that make files in it."""
    for made, stage in makers.items():
        if made == path or path.startswith(made + "/"):
            return [stage]
    return list(dict.fromkeys(stage for made, stage in makers.items() if made.startswith(path + "/")))


def lineage(made_from: list[dict[str, str]], settings: Mapping[str, str], seed: object = None) -> dict[str, Any]:
    """All that a run or a model was made from, for `lineage.json`; equal origins give equal content.

    Args:
        made_from: `path`, `md5` and, where it is known, `stage` of each input.
        settings: the configuration, flat.
        seed: of the training, where it is known.
    """
    commit, _, dirty = git_sha().partition("-")
    return {
        "schema": 1,
        "dvc_stage": os.environ.get("DVC_STAGE") or None,
        "code": {"commit": commit, "dirty": bool(dirty)},
        "versions": versions(),
        "seed": seed,
        "settings": dict(settings),
        "inputs": sorted(made_from, key=lambda entry: entry["path"]),
    }


def inputs_of_stage() -> list[dict[str, str]]:
    """The inputs of the stage that DVC runs in this process, with who made each."""
    stages = lock_file.locked_stages()
    makers = {out["path"]: name for name, stage in stages.items() for out in stage.get("outs", [])}
    found = []
    for path, md5 in current_inputs().items():
        made_by = ", ".join(_makers(path, makers))
        found.append({"path": path, "md5": md5} | ({"stage": made_by} if made_by else {}))
    return found


def versions() -> dict[str, str]:
    """Versions of Python and of what decides a result."""
    found = {"python": platform.python_version()}
    for name in ("torch", "mujoco", "rsl-rl-lib", "numpy", DISTRIBUTION):
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found


def place() -> str:
    """The workspace and machine that a stage belongs to; one that came to another machine is told it by `PLACE`."""
    return os.environ.get(PLACE) or f"{socket.gethostname()}:{Path.cwd()}"


@cache
def git_sha() -> str:
    """The commit of the code, "-dirty" at the end where tracked files differ; "unknown" outside git.

    A stage that came to another machine is told it by `COMMIT`: its work tree has the code without git.
    """
    if told := os.environ.get(COMMIT):
        return told
    here = Path(__file__).resolve().parent
    git = ["git", "-C", str(here)]
    try:
        sha = subprocess.run([*git, "rev-parse", "HEAD"], capture_output=True, text=True, check=True).stdout.strip()
        dirty = subprocess.run([*git, "status", "--porcelain", "-uno"], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return sha + ("-dirty" if dirty.stdout.strip() else "")
