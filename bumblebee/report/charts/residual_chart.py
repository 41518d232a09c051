"""The residual before and after the effects were added, by joint, on held-out rollouts."""

from math import isfinite
from typing import Any

from bumblebee.report.charts.chart import Axis, Strip, axis_over
from bumblebee.report.charts.figures import short_joint
from bumblebee.report.page import Block, strips

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


def residual_chart(error: dict[str, dict[str, Any]], horizon: str = "0.2") -> list[Block]:
    """Bars by joint at one horizon beside the noise floor; nothing where the blocks name no joints."""
    values = {name: joint_errors(error.get(name, {}), horizon) for name in _NAMES}
    joints = list(values["before"])
    if not joints:
        return []
    milli = {name: {joint: 1e3 * value for joint, value in found.items()} for name, found in values.items()}
    axis = axis_over([value for found in milli.values() for value in found.values()], 10)
    rows = [_row(axis, joint, {name: found[joint] for name, found in milli.items() if joint in found})
            for joint in joints]  # fmt: skip
    title = f"Joint position error by joint after {horizon} s [mrad]"
    return [strips(rows, ("0", f"{axis.high:.0f}"), tuple((f"was-{n}", told) for n, told in _NAMES.items()), title)]


def _row(axis: Axis, joint: str, errors: dict[str, float]) -> Strip:
    there = {name: value for name, value in errors.items() if isfinite(value)}
    marks = [axis.bar(f"was-{name}", there[name]) for name in ("before", "after") if name in there]
    marks += [axis.point("tick", "was-floor", there["floor"])] if "floor" in there else []
    tip = ", ".join(f"{_NAMES[name]} {value:.3g} mrad" for name, value in there.items())
    return Strip(short_joint(joint), tuple(marks), f"{there['after']:.3g}" if "after" in there else "–", tip)
