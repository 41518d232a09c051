"""Learning curves against frames, as lines that the mouse reads off."""

import numpy as np
import pandas as pd

from bumblebee.report.page import Block

_POINTS = 200  # of a line: what a page shows
_MEASURES = {
    "success": ("episodes that end well", 100.0, "%"),
    "key_error": ("key body error", 100.0, "cm"),
    "loss_model": ("loss of the learned model of the robot", 1.0, ""),
    "alive": ("imagined steps before an end", 100.0, "%"),
}
"""Columns that are drawn: name, factor and unit; the last two are the learner's `world_model` alone."""


def curves_charts(curves: dict[str, pd.DataFrame], title: str, caption: str) -> list[Block]:
    """A block for each measure; empty without curves.

    Args:
        curves: name -> columns frames, success, key_error [m] and others of `_MEASURES` (rows an iteration); smoothed
            here over 5 % of the rows.
        title: what the curves are of.
        caption: small print under each.
    """
    usable = {n: c for n, c in curves.items() if len(c) > 1 and "frames" in c}
    seen = {m: {n: c for n, c in usable.items() if m in c and c[m].notna().any()} for m in _MEASURES}
    return [_chart(found, measure, title, caption) for measure, found in seen.items() if found]


def _chart(curves: dict[str, pd.DataFrame], measure: str, title: str, caption: str) -> Block:
    name, factor, unit = _MEASURES[measure]
    smooth = {
        policy: factor * curve[measure].rolling(max(1, len(curve) // 20), min_periods=1).mean()
        for policy, curve in curves.items()
    }
    last = max(float(curve["frames"].max()) for curve in curves.values())
    most = 100.0 if unit == "%" else max(float(values.max()) for values in smooth.values()) or 1.0
    lines = tuple((policy, _points(curves[policy]["frames"] / last, smooth[policy] / most)) for policy in curves)
    scale, words = _frames_unit(last)
    return Block(
        "curves",
        title=f"{title}: {name}",
        caption=caption,
        alt=f"Learning curves of {', '.join(curves)}: {name} against simulated frames.",
        header=("0", f"{most:.3g} {unit}".strip(), f"{last / scale:.3g}{words} frames"),
        rows=lines,
        facts={"most": f"{most:.6g}", "unit": unit, "frames": f"{last:.0f}"},
    )


def _points(x: "pd.Series[float]", y: "pd.Series[float]") -> str:
    """Points of an SVG polyline in a square of 1000, its origin above; gaps are left out."""
    there = np.flatnonzero(y.notna().to_numpy())
    kept = there[np.unique(np.linspace(0, len(there) - 1, min(len(there), _POINTS)).astype(int))]
    across, up = x.to_numpy()[kept], y.to_numpy()[kept].clip(0, 1)
    return " ".join(f"{1000 * a:.0f},{1000 * (1 - b):.0f}" for a, b in zip(across, up, strict=True))


def _frames_unit(most: float) -> tuple[float, str]:
    """(divisor, its name) so that numbers are short."""
    return (1e6, " million") if most >= 1e6 else (1e3, " thousand") if most >= 1e3 else (1.0, "")
