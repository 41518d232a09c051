"""A row a set of motions: mean over motions with its bootstrap interval, and the worst motion by name."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from bumblebee.evaluation.intervals import bootstrap_mean

Row = dict[str, Any]


def summary(rows: Mapping[str, Mapping[str, float]]) -> dict[str, Row]:
    """For each measure its mean over motions, 95 % interval, number of motions and worst one; NaN is left out.

    Args:
        rows: name of a motion -> measure -> value.
    """
    measures = dict.fromkeys(measure for row in rows.values() for measure in row)
    return {measure: _measure({n: row[measure] for n, row in rows.items() if measure in row}) for measure in measures}


def markdown(sets: Mapping[str, Mapping[str, Row]], measures: Iterable[str] | None = None) -> str:
    """The summaries of several sets as a table, a column a set: mean [interval], and the worst with its name."""
    wanted = list(measures or dict.fromkeys(measure for rows in sets.values() for measure in rows))
    lines = ["| mean over motions [95 %]; worst | " + " | ".join(sets) + " |", "|---" * (len(sets) + 1) + "|"]
    for measure in wanted:
        cells = [cell(rows.get(measure)) for rows in sets.values()]
        lines.append(f"| `{measure}` | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def cell(row: Row | None) -> str:
    """One summary in a table's cell."""
    if row is None or row["mean"] is None:
        return "-"
    interval = "" if row["low"] is None else f" [{_short(row['low'])}, {_short(row['high'])}]"
    return f"{_short(row['mean'])}{interval}; {_short(row['worst'])} `{row['worst_motion']}`"


def _measure(values: Mapping[str, float]) -> Row:
    held = {name: float(value) for name, value in values.items() if np.isfinite(value)}
    if not held:
        return {"mean": None, "low": None, "high": None, "n": 0, "worst": None, "worst_motion": None}
    # All measures but the share of contact are the worse the larger; of that, the largest is shown likewise.
    worst = max(held, key=lambda name: held[name])
    numbers = np.array(list(held.values()))
    low, high = (float(bound) if np.isfinite(bound) else None for bound in bootstrap_mean(numbers))
    if low is not None and numbers.min() >= 0:
        low = max(low, 0.0)  # widened for few motions, an interval may leave what can be
    mean = float(numbers.mean())
    return {"mean": mean, "low": low, "high": high, "n": len(held), "worst": held[worst], "worst_motion": worst}


def _short(value: float) -> str:
    return "0" if value == 0 else f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"
