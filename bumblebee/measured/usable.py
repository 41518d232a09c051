"""Whether a rollout may be learned from, outside the loop, where no intake has looked at it: the contract's checks."""

import mujoco

from bumblebee.errors import BadInput
from bumblebee.measured.checks import Finding, check_rollout
from bumblebee.measured.rollout import Rollout


def review(rollout: Rollout, model: mujoco.MjModel, file: str = "") -> tuple[BadInput | None, list[str]]:
    """Why a rollout cannot be used (None: it can), and what a person should know of it, one line each.

    Args:
        rollout: as read.
        model: the declared model.
        file: the name that the lines carry; the rollout's own by default.
    """
    findings = check_rollout(rollout, model, file=file)
    fatal = next((finding for finding in findings if finding.fatal), None)
    return None if fatal is None else refusal(fatal), [f.message for f in findings if not f.fatal]


def refusal(finding: Finding) -> BadInput:
    """A fatal finding as an error that names file, column, row and rule."""
    row = "" if finding.row is None else f", row {finding.row}"
    where = f"{finding.file}: column {finding.column}{row}: rule {finding.rule}"
    return BadInput(where, finding.expected, finding.came)
