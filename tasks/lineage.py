"""What a stage was made from: the MD5 of each of its inputs as DVC counts it, and the git commit."""

import hashlib
import json
import os
import subprocess
from functools import cache
from pathlib import Path
from typing import Any


def path_hash(path: Path) -> str:
    """DVC's hash of a file or folder (`.dir` at the end for a folder); "missing" where there is none."""
    if path.is_dir():
        listing = [
            {"md5": _file_md5(file), "relpath": file.relative_to(path).as_posix()}
            for file in sorted(path.rglob("*"))
            if file.is_file() and "__pycache__" not in file.parts
        ]
        listing.sort(key=lambda entry: entry["relpath"])
        return hashlib.md5(json.dumps(listing, sort_keys=True).encode()).hexdigest() + ".dir"
    return _file_md5(path) if path.is_file() else "missing"


def _file_md5(path: Path) -> str:
    digest = hashlib.md5()
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def stage_inputs(stage: str, root: Path = Path(".")) -> dict[str, str]:
    """Path -> hash of every dependency of a DVC stage, and `params:<section>` -> hash of its parameters."""
    from dvc.dependency.param import ParamsDependency
    from dvc.repo import Repo

    found: dict[str, str] = {}
    with Repo(str(root)) as repo:
        for loaded in repo.stage.load_all("dvc.yaml"):
            if loaded.addressing != stage:
                continue
            for dep in loaded.deps:
                if isinstance(dep, ParamsDependency):
                    for section, values in dep.read_params().items():
                        text = json.dumps(values, sort_keys=True, default=str)
                        found[f"params:{section}"] = hashlib.md5(text.encode()).hexdigest()
                else:
                    found[str(dep.def_path)] = path_hash(Path(dep.fs_path))
    return found


@cache
def current_inputs() -> dict[str, str]:
    """The inputs of the stage that DVC runs in this process; empty when it was started by hand."""
    stage = os.environ.get("DVC_STAGE")
    return stage_inputs(stage) if stage else {}


def upstream(output: Path, lock: Path = Path("dvc.lock")) -> dict[str, str]:
    """Path -> hash of everything that `output` was made from, over all stages back to the first, by dvc.lock.

    Parameters are `params:<section>` -> hash of their values. Empty where DVC has not made the output.
    """
    if not lock.exists():
        return {}
    stages = _locked_stages(lock.read_text())
    makers = {out["path"]: stage for stage in stages.values() for out in stage.get("outs", [])}
    found: dict[str, str] = {}
    waiting = [output.as_posix()]
    while waiting:
        path = waiting.pop()
        stage = _maker(path, makers)
        for dep in stage.get("deps", []):
            if dep["path"] not in found:
                found[dep["path"]] = str(dep.get("md5", "missing"))
                waiting.append(dep["path"])
        for section, values in stage.get("params", {}).get("params.yaml", {}).items():
            text = json.dumps(values, sort_keys=True, default=str)
            found[f"params:{section}"] = hashlib.md5(text.encode()).hexdigest()
    return found


@cache
def _locked_stages(text: str) -> dict[str, Any]:
    """The stages of a dvc.lock; read once, since a policy's history is asked for again and again."""
    import yaml

    return dict(yaml.safe_load(text).get("stages", {}))


def _maker(path: str, makers: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """The stage that makes `path`, a folder around it, or files in it."""
    for made, stage in makers.items():
        if made == path or path.startswith(made + "/"):
            return stage
    inside = [stage for made, stage in makers.items() if made.startswith(path + "/")]
    if not inside:
        return {}
    merged: dict[str, Any] = {"deps": [dep for stage in inside for dep in stage.get("deps", [])]}
    sections = {k: v for stage in inside for k, v in stage.get("params", {}).get("params.yaml", {}).items()}
    return {**merged, "params": {"params.yaml": sections}}


@cache
def git_sha() -> str:
    """The commit of the code, "-dirty" at the end where tracked files differ; "unknown" outside git."""
    here = Path(__file__).resolve().parent
    git = ["git", "-C", str(here)]
    try:
        sha = subprocess.run([*git, "rev-parse", "HEAD"], capture_output=True, text=True, check=True).stdout.strip()
        dirty = subprocess.run([*git, "status", "--porcelain", "-uno"], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return sha + ("-dirty" if dirty.stdout.strip() else "")
