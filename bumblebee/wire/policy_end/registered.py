"""A registered policy by its name: `bumblebee fetch` copies it; where people were asked, they must have approved it.

Registry and answers belong to floors above, so that command is a process of its own.
"""

import os
import subprocess
import sys
from pathlib import Path

import bumblebee
from bumblebee.errors import BadInput


def fetched(name: str, workspace: Path, out: Path) -> str:
    """Copy a registered policy to `out`, a new folder; the line that says who let it through.

    Args:
        name: `NAME@ALIAS`.
        workspace: folder with the registry and the answers of people.
        out: new folder.

    Raises:
        BadInput: no such policy, or people were asked about it and have not approved this file.
    """
    words = [sys.executable, "-m", "bumblebee", "fetch", name, "--workspace", str(workspace), "--out", str(out)]
    code = os.pathsep.join(filter(None, (str(Path(bumblebee.__file__).parents[1]), os.environ.get("PYTHONPATH"))))
    environment = os.environ | {"PYTHONPATH": code}
    ended = subprocess.run([*words, "--approved"], capture_output=True, text=True, check=False, env=environment)
    if ended.returncode:
        said = (ended.stderr.strip().splitlines() or [f"status {ended.returncode}"])[-1]
        raise BadInput(name, "a policy that `bumblebee fetch --approved` copies", said.removeprefix("error: "))
    return f"{name}: {ended.stdout.strip().splitlines()[-1]}"
