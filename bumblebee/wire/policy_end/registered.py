"""A registered policy by its name: `bumblebee fetch` copies it; where people were asked, they must have approved it.

The registry belongs to floors above, so that command is a process of its own; answers of people are read here.
"""

import os
import subprocess
import sys
from pathlib import Path
from shlex import join

import bumblebee
from bumblebee.errors import BadInput
from bumblebee.io.read import file_hash
from bumblebee.measured import gate_record

_APPROVALS = Path("data") / "approvals"


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
    ended = subprocess.run(words, capture_output=True, text=True, check=False, env=os.environ | {"PYTHONPATH": code})
    if ended.returncode:
        said = (ended.stderr.strip().splitlines() or [f"status {ended.returncode}"])[-1]
        raise BadInput(name, "a policy that `bumblebee fetch` copies", said.removeprefix("error: "))
    return f"{name}: {let_through(name.partition('@')[0], out / 'policy.onnx', workspace)}"


def let_through(model: str, onnx: Path, workspace: Path) -> str:
    """Who approved a policy's file; a workspace that asks nobody is told.

    Raises:
        BadInput: people were asked, and the last answer about this file is not an approval, or there is none.
    """
    answers = [one["answer"] for one in gate_record.check(workspace / _APPROVALS)]
    own = [one for one in answers if one.get("model") == model]
    if not own and not (workspace / _APPROVALS / f"promotion-{model}.json").exists():
        return "no person was asked about it (publish.promotion.mode: auto), the evaluation's numbers alone decided"
    digest = file_hash(onnx)
    last = next((one for one in reversed(own) if one.get("seen", {}).get("onnx_sha256") == digest), None)
    if last is None or last.get("status") != "approved":
        came = "no answer" if last is None else str(last.get("status"))
        do = f"Run: {join(['bumblebee', 'gate', 'show', model, '--workspace', str(workspace.resolve())])}"
        raise BadInput(f"{model}: {digest[:12]}", "an approval by people of this file", came, do)
    return f"approved by {last.get('by', 'a person')}"
