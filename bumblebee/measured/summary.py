"""The numbers that a person sees of a batch: counts by rule, by motion and by cluster, seconds, joints."""

from collections import Counter
from collections.abc import Iterable
from typing import Any

from bumblebee.measured.intake import IntakeSummary, Item

SCHEMA = 1


def summary_table(batch: IntakeSummary, round: int) -> dict[str, Any]:
    """The content of summary.json; it holds no times of day, so that the same files give the same bytes."""
    good = [item for item in batch.items if item.accepted]
    return {
        "schema": SCHEMA,
        "round": round,
        "accepted": len(good),
        "quarantined": len(batch.items) - len(good),
        "seconds": float(f"{sum(item.seconds for item in good):.6g}"),
        "joints": _joints(good),
        "by_rule": rule_counts(batch),
        "by_motion": _verdicts((item.motion or "unknown", item.accepted) for item in batch.items),
        "by_cluster": _verdicts((item.cluster or "unknown", item.accepted) for item in batch.items),
        "files": [
            {"file": item.file, "sha256": item.sha256, "accepted": item.accepted, "motion": item.motion}
            | {"cluster": item.cluster, "seconds": item.seconds}
            for item in sorted(batch.items, key=lambda item: (item.cluster, item.file, item.sha256))
        ],
    }


def rule_counts(batch: IntakeSummary) -> dict[str, dict[str, int]]:
    """Rule -> {"files", "fatal", "warning"}: how many files broke it and how often either way."""
    table = batch.findings
    return {
        str(rule): {
            "files": int(part["file"].nunique()),
            "fatal": int(part["fatal"].sum()),
            "warning": int((~part["fatal"]).sum()),
        }
        for rule, part in table.groupby("rule", sort=True)
    }


def _verdicts(pairs: Iterable[tuple[str, bool]]) -> dict[str, dict[str, int]]:
    counts = Counter(pairs)
    names = sorted({name for name, _ in counts})
    return {name: {"accepted": counts[name, True], "quarantined": counts[name, False]} for name in names}


def _joints(items: list[Item]) -> list[str]:
    """Every joint of the accepted files, in the order in which they first appear."""
    return list(dict.fromkeys(joint for item in items for joint in item.joints))
