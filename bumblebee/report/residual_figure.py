"""The residual before and after the effects were added, by joint and by horizon, on held-out rollouts."""

from typing import Any

import numpy as np

from bumblebee.report.figures import INK, canvas, colour, legend_below, short, short_joint, svg_uri

_BLOCKS = ("before", "after", "floor")
_SHADES = {"before": "#b9c0c9", "after": colour(0), "floor": INK}
_NAMES = {"before": "declared model", "after": "corrected model", "floor": "noise floor"}


def value_and_interval(entry: Any) -> tuple[float, float, float]:
    """A number of an error block with its interval: {"value", "ci95"}, a bare number, or nothing."""
    if isinstance(entry, dict):
        low, high = entry.get("ci95") or (None, None)
        value = entry.get("value", entry.get("all"))
        return tuple(float("nan") if x is None else float(x) for x in (value, low, high))  # type: ignore[return-value]
    value = float("nan") if entry is None else float(entry)
    return value, float("nan"), float("nan")


def joint_errors(block: dict[str, Any], horizon: str) -> dict[str, float]:
    """Joint -> RMS position error [rad] of one block (`before`, `after` or `floor`) at one horizon."""
    entry = block.get(horizon, {}).get("joint_pos_rmse", {})
    per_joint = (entry.get("per_joint") or entry.get("joints") or {}) if isinstance(entry, dict) else {}
    return {name: value_and_interval(value)[0] for name, value in per_joint.items()}


def residual_figure(error: dict[str, dict[str, Any]], horizon: str = "0.2") -> str | None:
    """Bars by joint at one horizon; image URI, None where the blocks name no joints."""
    values = {name: joint_errors(error.get(name, {}), horizon) for name in _BLOCKS}
    joints = list(values["before"])
    if not joints:
        return None
    figure, axis = canvas(height=0.7 + 0.215 * len(joints))
    y = np.arange(len(joints))
    for name, shift in (("before", -0.2), ("after", 0.2)):
        widths = [1e3 * values[name].get(joint, np.nan) for joint in joints]
        axis.barh(y + shift, widths, 0.38, color=_SHADES[name], label=_NAMES[name])
    floor = [1e3 * values["floor"].get(joint, np.nan) for joint in joints]
    if np.isfinite(floor).any():
        axis.vlines(floor, y - 0.42, y + 0.42, color=_SHADES["floor"], lw=1.4, label=_NAMES["floor"])
    axis.set_yticks(y, [short(short_joint(joint), 18) for joint in joints])
    axis.set_ylim(len(joints) - 0.4, -0.6)
    axis.set(xlabel=f"RMS error after {horizon} s [mrad]")
    axis.grid(axis="y", visible=False)
    legend_below(figure, axis)
    return svg_uri(figure)
