"""Who let a policy's file through: where people were asked about it, they must have approved just this file."""

from pathlib import Path
from shlex import join

from bumblebee.errors import BadInput
from bumblebee.io.read import file_hash
from tasks.approvals import ledger

_APPROVALS = Path("data") / "approvals"


def let_through(model: str, onnx: Path, workspace: Path) -> str:
    """Who approved a policy's file; a workspace that asks nobody is told.

    Raises:
        BadInput: people were asked, and the last answer about this file is not an approval, or there is none.
    """
    answers = [one["answer"] for one in ledger.check(workspace / _APPROVALS)]
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
