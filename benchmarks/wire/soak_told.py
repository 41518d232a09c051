"""Sums of a soak's lines: hours, faults of each kind, how long after its deadline the latest damping came."""

from collections.abc import Sequence
from typing import Any

LEVEL = 0.02
"""Largest time from the deadline to damping [s]."""
LATE_WAKE = 0.005
"""A guard that wakes up later than one tick was kept from running by the machine [s]."""


def told(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Lines of a Markdown table, and what stands beside it."""
    struck = [row for row in rows if "early" not in row]
    hours = sum(row.get("seconds", 0.0) for row in rows) / 3600
    lines = [
        f"{hours:.2f} h, {len(struck)} faults; {len(rows) - len(struck)} runs ended before theirs",
        "| fault | times | damped | latest after the deadline [ms] | beyond 20 ms | of these the guard woke up late |",
        "|---|---|---|---|---|---|",
    ]
    for kind in sorted({row["kind"] for row in struck}):
        own = [row for row in struck if row["kind"] == kind]
        damped = [row for row in own if row["over"] is not None]
        over = [row for row in damped if row["over"] > LEVEL]
        latest = f"{1e3 * max(row['over'] for row in damped):.1f}" if damped else "–"
        woken = sum(row["wake"] > LATE_WAKE for row in over)
        lines.append(f"| {kind} | {len(own)} | {len(damped)} | {latest} | {len(over)} | {woken} |")
    undamped = [row["number"] for row in struck if row["must"] and row["over"] is None]
    lines.append(f"not damped though the fault lasted beyond the deadline: {undamped or 0}")
    kept = [row["lost"] for row in struck if "lost" in row]
    lines.append(f"{len(kept)} kills; the journal lacks at most {max(kept, default=0.0):.3f} s before one")
    return lines
