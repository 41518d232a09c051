"""The stand-in robot as stages use it: a process of its own, which alone reads what was sealed."""

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import bumblebee
from bumblebee.errors import BadInput
from bumblebee.motion.clip import Clip
from tasks.running import paths

DIRECT = ["-m", "bumblebee.stand_in.process"]
"""Process of the robot that is stepped with the policy."""


def start_stand_in(
    plan: dict[str, Any],
    clips: Path,
    out: Path,
    work: Path,
    threads: int,
    sealed: Path = paths.SEALED_ROBOT,
    module: Sequence[str] = DIRECT,
) -> None:
    """Run a plan on the stand-in robot, in another process, which alone reads the sealed effects."""
    if not sealed.exists():
        raise BadInput(sealed, "the sealed robot", "no such file", "Run the stage seal.")
    file = work / "plan.json"
    file.write_text(json.dumps(plan))
    command = [sys.executable, *module, "--sealed", str(sealed), "--clips", str(clips)]
    command += ["--plan", str(file), "--out", str(out), "--threads", str(threads), "--with-parent"]
    # The same code as ours, also where it is not installed and the workspace is elsewhere.
    code = os.pathsep.join(filter(None, (str(Path(bumblebee.__file__).parents[1]), os.environ.get("PYTHONPATH"))))
    ended = subprocess.run(
        command, stderr=subprocess.PIPE, text=True, check=False, env={**os.environ, "PYTHONPATH": code}
    )
    if ended.returncode:
        lines = ended.stderr.strip().splitlines()
        raise BadInput(
            "stand-in robot", "its process to end with status 0", f"{ended.returncode}: {lines[-1] if lines else ''}"
        )


def cut(clip: Clip, seconds: float) -> Clip:
    """The beginning of a clip, at most `seconds` long."""
    frames = min(clip.frames, int(seconds * clip.fps) + 1)
    arrays = {name: getattr(clip, name)[:frames] for name in ("root_pos", "root_quat", "joint_pos", "key_pos")}
    return replace(clip, **arrays)
