"""Whether a diagnosis has shown that its effects are there, before anything is undone on a robot that can fall.

An effect with the wrong name may fit the windows and be undone all the same: a robot that lost half of its commands was
diagnosed as late, and followed none of its motions once that delay was made up for. There the corrected model had
hardly been better on held-out rollouts.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bumblebee.errors import BadInput
from bumblebee.io.read import read_json

HORIZON = "0.2"  # [s] of the error block
UNPROVEN = "Record more rollouts and diagnose again, or pass --unproven to undo it all the same."


def why_unproven(document: Mapping[str, Any]) -> str:
    """Why a diagnosis's document does not show a better model on held-out rollouts; "" where it does.

    It does where the 95 % interval of the corrected model's joint error after 0.2 s lies below the declared model's.
    """
    try:
        if not document["effects"]:
            return ""
        before, after = (document["error"][part][HORIZON]["joint_pos_rmse"] for part in ("before", "after"))
        first, last = before["ci95"], after["ci95"]
        said = f"{_said(before)} mrad with the declared model, {_said(after)} with the corrected one"
        if first is None or last is None:
            return f"too few held-out rollouts for an interval of the joint error after {HORIZON} s: {said}"
        if not last[1] < first[0]:
            return f"the joint error after {HORIZON} s on held-out rollouts is not shown to be smaller: {said}"
    except (KeyError, TypeError, ValueError, IndexError):
        return "its diagnosis.json has no error before and after on held-out rollouts"
    return ""


def _said(error: Mapping[str, Any]) -> str:
    """A joint error in mrad with its interval."""
    value, ends = error["value"], error["ci95"]
    interval = f" [{1e3 * ends[0]:.1f}, {1e3 * ends[1]:.1f}]" if ends else ""
    return f"{1e3 * value:.1f}{interval}" if value is not None else "none"


def require_proven(effects: Path) -> None:
    """`BadInput` where the diagnosis beside an `effects.yaml` shows no better model; with none beside it nothing."""
    document = effects.parent / "diagnosis.json"
    if document.is_file() and (why := why_unproven(read_json(document))):
        raise BadInput(effects, "effects of a model that is better on held-out rollouts", why, UNPROVEN)
