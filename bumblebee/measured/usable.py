"""Whether a rollout may be learned from, outside the loop, where no intake has looked at it: the contract's checks."""

from dataclasses import dataclass

import mujoco

from bumblebee.errors import BadInput
from bumblebee.measured.checks import Finding, check_rollout
from bumblebee.measured.rollout import Rollout


@dataclass(frozen=True)
class Review:
    """Review of one rollout by the checks."""

    findings: tuple[Finding, ...]

    @property
    def fatal(self) -> list[Finding]:
        """Why it cannot be used; empty where it can."""
        return [finding for finding in self.findings if finding.fatal]

    @property
    def refused(self) -> BadInput | None:
        """The first reason, as an error; None where it can be used."""
        return refusal(self.fatal[0]) if self.fatal else None

    @property
    def warnings(self) -> list[str]:
        """Warnings that a person should know, one line each."""
        return [finding.message for finding in self.findings if not finding.fatal]


def review(rollout: Rollout, model: mujoco.MjModel, file: str = "") -> Review:
    """Review a rollout by the checks.

    Args:
        rollout: as read.
        model: the declared model.
        file: the name that the lines carry; the rollout's own by default.
    """
    return Review(tuple(check_rollout(rollout, model, file=file)))


def refusal(finding: Finding) -> BadInput:
    """A fatal finding as an error that names file, column, row and rule."""
    row = "" if finding.row is None else f", row {finding.row}"
    where = f"{finding.file}: column {finding.column}{row}: rule {finding.rule}"
    return BadInput(where, finding.expected, finding.came, finding.do)
