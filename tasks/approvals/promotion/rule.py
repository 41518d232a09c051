"""Whether a new policy takes the alias `champion`: pure functions on numbers of the frozen evaluation."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

CHAMPION = "champion"
ALPHA = 0.05
ROUNDING = 1e-6
"""Rates that are closer than this are equal: a version's tag keeps six digits."""


@dataclass(frozen=True)
class Verdict:
    """The answer and its reason."""

    promoted: bool
    """Whether the alias moves."""
    reason: str
    """One sentence with the numbers."""


def unchanged(parent: str) -> Verdict:
    """A policy whose ONNX file is its parent's: nothing to compare, a file is no better or worse than itself."""
    return Verdict(True, f"unchanged: the same file as its parent {parent}")


def against_parent(comparison: Mapping[str, Any] | None) -> Verdict:
    """A policy against the one it was trained from, paired over motions of one evaluation.

    It holds unless the child is shown to be worse: the interval of the difference lies below zero and the paired test
    over motions agrees (p <= 0.05), since an interval from two motions can be as narrow as nought.

    Args:
        comparison: `success` as `{"value", "ci95": [low, high], "p"}`, child minus parent, or None.
    """
    if comparison is None:
        return Verdict(True, "no parent in this evaluation")
    value, (low, high), p = (comparison["success"][key] for key in ("value", "ci95", "p"))
    if value is None:
        return Verdict(True, "nothing to compare with")
    text = f"success {value:+.3f} against its parent"
    text += ", one motion" if high is None else f", 95 % interval {low:+.3f} to {high:+.3f}, p = {p:.2g}"
    worse = high is not None and high < -ROUNDING and p <= ALPHA
    return Verdict(not worse, f"{text}: {'worse' if worse else 'not shown to be worse'}")


def against_champion(
    now: Mapping[str, Any],
    champion: Mapping[str, str] | None,
    contract: str,
    engine: str,
    replace_incomparable: bool = False,
    onnx_sha256: str = "",
) -> Verdict:
    """A policy against the registered champion, by the numbers that were kept with that version.

    Where the champion is the same file there is nothing to compare. It stays, unless its numbers are of another
    evaluation: then the alias moves to the version that has this one's, so that what comes later can be compared.

    Args:
        now: the success rate of the new policy as `{"value", "ci95": [low, high]}`.
        champion: tags of the champion's version, None where there is none.
        contract: sha256 of the evaluation's contract; numbers under another one cannot be compared.
        engine: the robot of the evaluation; nor can numbers on another one.
        replace_incomparable: whether a champion whose numbers cannot be compared gives way.
        onnx_sha256: of the new policy's file.
    """
    if champion is None:
        return Verdict(True, "the first version")
    same = champion.get("evaluation_contract") == contract and champion.get("evaluation_engine") == engine
    comparable = same and "success" in champion
    if onnx_sha256 and champion.get("onnx_sha256") == onnx_sha256:
        if comparable:
            return Verdict(False, "the champion is the same file and stays")
        return Verdict(
            True, "the champion is the same file, evaluated under another contract: it gets this one's numbers"
        )
    if not comparable:
        reason = "the champion was evaluated under another contract"
        if replace_incomparable:
            return Verdict(True, f"{reason}, and publish.replace_incomparable lets the new version take its place")
        return Verdict(False, f"{reason}, so it stays: to replace it, set publish.replace_incomparable: true")
    before, value, high = float(champion["success"]), now["value"], now["ci95"][1]
    worse = max(value, value if high is None else high) < before - ROUNDING
    interval = "" if high is None else f" (95 % interval up to {high:.3f})"
    text = f"success {value:.3f}{interval} against the champion's {before:.3f}"
    return Verdict(not worse, f"{text}: {'worse' if worse else 'not shown to be worse'}")


def both(*verdicts: Verdict) -> Verdict:
    """Promoted only if each says so."""
    return Verdict(all(v.promoted for v in verdicts), "; ".join(v.reason for v in verdicts))
