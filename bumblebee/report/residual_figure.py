"""The residual before and after the effects were added, by joint and by horizon, on held-out rollouts."""

from typing import Any

import numpy as np

from bumblebee.report.figures import GRID, QUIET, canvas, colour, short_joint, svg_uri

_BLOCKS = ("before", "after", "floor")
_SHADES = {"before": "#b9c0c9", "after": colour(0), "floor": QUIET}
_NAMES = {"before": "declared model", "after": "corrected model", "floor": "sensor noise alone"}


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
    figure, (axis,) = canvas(1, height=3.6)
    x = np.arange(len(joints))
    for name, shift in (("before", -0.2), ("after", 0.2)):
        heights = [1e3 * values[name].get(joint, np.nan) for joint in joints]
        axis.bar(x + shift, heights, 0.38, color=_SHADES[name], label=_NAMES[name])
    floor = [1e3 * values["floor"].get(joint, np.nan) for joint in joints]
    axis.hlines(floor, x - 0.42, x + 0.42, color=_SHADES["floor"], lw=1.2, label=_NAMES["floor"])
    axis.set_xticks(x, [short_joint(joint) for joint in joints], rotation=55, ha="right", fontsize=8)
    axis.set(ylabel="mrad", title=f"Joint position error after {horizon} s, held-out rollouts")
    axis.grid(axis="x", color=GRID, lw=0)
    axis.legend(ncols=3, fontsize=8.5, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return svg_uri(figure)
