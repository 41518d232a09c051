"""Whether a new policy takes the alias `champion`: pure functions on numbers of the frozen evaluation."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

CHAMPION = "champion"


@dataclass(frozen=True)
class Verdict:
    """The answer and its reason."""

    promoted: bool
    """Whether the alias moves."""
    reason: str
    """One sentence with the numbers."""


def against_parent(comparison: Mapping[str, Any] | None) -> Verdict:
    """A policy against the one it was trained from, paired over motions of one evaluation.

    It holds unless the child's success is lower by more than the interval of the difference allows.

    Args:
        comparison: `success` as `{"value", "ci95": [low, high]}`, child minus parent; None where there is no parent.
    """
    if comparison is None:
        return Verdict(True, "no parent in this evaluation")
    value, (low, high) = comparison["success"]["value"], comparison["success"]["ci95"]
    if value is None:
        return Verdict(True, "nothing to compare with")
    text = f"success {value:+.3f} against its parent"
    text += "" if high is None else f", 95 % interval {low:+.3f} to {high:+.3f}"
    worse = value < 0 if high is None else high < 0
    return Verdict(not worse, f"{text}: {'worse' if worse else 'not worse'}")


def against_champion(now: Mapping[str, Any], champion: Mapping[str, str] | None, contract: str) -> Verdict:
    """A policy against the registered champion, by the numbers that were kept with that version.

    Args:
        now: the success rate of the new policy as `{"value", "ci95": [low, high]}`.
        champion: tags of the champion's version, None where there is none.
        contract: sha256 of the evaluation's contract; numbers under another one cannot be compared.
    """
    if champion is None:
        return Verdict(True, "the first version")
    if champion.get("evaluation_contract") != contract or "success" not in champion:
        return Verdict(True, "the champion was evaluated under another contract")
    before, value, high = float(champion["success"]), now["value"], now["ci95"][1]
    worse = value < before if high is None else high < before
    text = f"success {value:.3f} (95 % interval up to {high:.3f}) against the champion's {before:.3f}"
    return Verdict(not worse, f"{text}: {'worse' if worse else 'not worse'}")


def both(*verdicts: Verdict) -> Verdict:
    """Promoted only if each says so."""
    return Verdict(all(v.promoted for v in verdicts), "; ".join(v.reason for v in verdicts))
