"""GPUs of this machine for stages that run side by side: each stage sees its own ones alone.

Without this every stage takes the first device. Those that may be used are those of CUDA_VISIBLE_DEVICES of the process
that starts the loop, or else all of the machine: `CUDA_VISIBLE_DEVICES=0,2 make demo`.
"""

import os
import re
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.read import read_yaml
from flows.stages import kind_of
from tasks.settings import params

VARIABLE = "CUDA_VISIBLE_DEVICES"
_users: Counter[str] = Counter()  # stages that run on each device
_lock = threading.Lock()


def wanted(content: Mapping[str, Any], sections: Iterable[str]) -> int:
    """GPUs for a stage that reads these sections: the most that one of them names, or 1 for the engine on a GPU."""
    found = [0]
    for name in sections:
        section = content.get(name)
        if isinstance(section, dict):
            env = section.get("env")
            own = env if isinstance(env, dict) else section
            number = section.get("gpus", int(own.get("engine") == "mujoco_warp"))
            found.append(number if isinstance(number, int) else 0)
    return max(found)


def wanted_by(workspace: Path, stage: str) -> int:
    """GPUs for a stage of a workspace."""
    described = read_yaml(workspace / "dvc.yaml")["stages"].get(kind_of(stage), {})  # none: a set in data/raw
    return wanted(params.read(workspace / "params.yaml"), described.get("params", []))


def usable(variables: Mapping[str, str] = os.environ) -> list[str]:
    """Names of the devices that may be used, as CUDA takes them; none on a machine without a GPU."""
    stated = variables.get(VARIABLE)
    if stated is not None:
        return [name for name in (part.strip() for part in stated.split(",")) if name and name != "-1"]
    try:  # by what they are, since CUDA counts them in another order than the driver
        said = subprocess.run(["nvidia-smi", "-L"], capture_output=True, text=True, check=True, timeout=60).stdout
    except (OSError, subprocess.SubprocessError):
        return []
    return re.findall(r"^GPU .*\(UUID: (GPU-[^)]+)\)", said, re.MULTILINE)


def require(workspace: Path, stages: Iterable[str]) -> None:
    """Refuse stages that would want a GPU hours from now, on a machine without one.

    Raises:
        BadInput: for the first of them, by name.
    """
    file = workspace / "params.yaml"
    content = params.read(file)
    if not wanted(content, content) or usable():
        return
    described = read_yaml(workspace / "dvc.yaml")["stages"]
    lacking = [name for name in sorted(stages) if wanted(content, described.get(kind_of(name), {}).get("params", []))]
    if lacking and not _seen_by_torch():
        do = "Run it where there is one, or change `engine` to `mujoco` for the processor."
        raise BadInput(f"{file}: engine mujoco_warp", f"an NVIDIA GPU for the stage {lacking[0]}", "none here", do)


def _seen_by_torch() -> bool:
    """Whether torch, in a process of its own, finds a GPU, as in a container without the driver's program."""
    command = [sys.executable, "-c", "import torch; raise SystemExit(not torch.cuda.is_available())"]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


@contextmanager
def lent(count: int, devices: list[str]) -> Iterator[dict[str, str]]:
    """The variable for a stage that wants `count` devices: those on which the fewest stages run, while it lasts.

    More stages than devices share them; a stage that wants more than there are sees all, and says itself what it lacks.
    """
    with _lock:
        own = sorted(devices, key=lambda device: _users[device])[:count]
        _users.update(own)
    try:
        yield {VARIABLE: ",".join(own)} if own else {}
    finally:
        with _lock:
            _users.subtract(own)
