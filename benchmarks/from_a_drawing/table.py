"""The table of a file of results."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.from_a_drawing.case import MORE
from benchmarks.undeclared.table import number, share

HORIZONS = ("0.02", "0.2", "1.0")
_NEAR = 0.15
"""Relative error of a size that counts as found."""
_CLOSE = 2.0
"""Times the noise floor that a solved robot may be off."""


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Medians of each kind of robot with their intervals, shares with their counts."""
    kinds = dict.fromkeys(row.get("robot", "arm") for row in rows)
    return "\n\n".join(_of_one([row for row in rows if row.get("robot", "arm") == kind], kind) for kind in kinds)


def _of_one(rows: Sequence[dict[str, Any]], robot: str) -> str:
    failed = [row for row in rows if "failed" in row]
    rows = [row for row in rows if "failed" not in row]
    if not rows:
        return f"{robot}: {len(failed)} failed, none diagnosed"
    more = ", ".join(f"{sum(r['more'] == m for r in rows)} with {m} more" for m in MORE)
    out = [f"{robot}, {len(rows)} diagnosed, {len(failed)} failed: {more}"]
    for h in HORIZONS:
        before, after, floor = np.array([r["errors"][h] for r in rows], float).T * 1e3
        medians = ", ".join(
            f"{name} {number(values.tolist())}"
            for name, values in (("declared", before), ("corrected", after), ("noise", floor))
        )
        solved = share((after <= _CLOSE * floor).tolist())
        out.append(
            f"after {h} s, mrad: median {medians}; largest corrected {after.max():.3g}; "
            f"within {_CLOSE:g} times the noise {solved}"
        )
    for kind in ("armature", "coulomb_friction"):
        errors = np.abs(np.concatenate([r["sizes"][kind] for r in rows]))
        near = share((errors <= _NEAR).tolist())
        out.append(f"{kind} within {_NEAR:.0%}: {near}; median error {np.median(errors):.1%}")
    seconds = [r["seconds"] for r in rows]
    out.append(f"seconds: median {np.median(seconds):.0f}, most {max(seconds):.0f}")
    return "\n".join(out)
