"""Which step helped: each paired difference in success as a dot with its interval, coloured by what it shows."""

from collections.abc import Sequence

from bumblebee.report.charts.chart import Strip, axis_over
from bumblebee.report.page import Block, strips
from bumblebee.report.results import Json
from bumblebee.report.wording import MEASURES, change, shown, signed

_TONES = {"better": "good", "worse": "bad", "no difference shown": "even"}


def gains_chart(steps: Sequence[tuple[str, Json]], where: str) -> list[Block]:
    """One chart of one engine; nothing where no step changed anything.

    Args:
        steps: what a step is called, and its entry of `comparisons`.
        where: the engine, as "on the robot".
    """
    told = [(called, entry) for called, entry in steps if not entry.get("unchanged") and _value(entry) is not None]
    if not any(_value(entry) for _, entry in told):
        return []
    numbers = [100 * value for _, entry in told for value in (_value(entry), *entry["success"]["ci95"]) if value]
    axis = axis_over([max(-100.0, min(100.0, value)) for value in numbers], 20)
    rows = []
    for called, entry in told:
        success = entry["success"]
        low, high = success["ci95"]
        sure = low is not None and high is not None
        tone = _TONES[shown(low, high, success["p"])] if sure else "even"
        marks = [axis.point("tick", "zero", 0), axis.point("dot", tone, 100 * success["value"])]
        if sure:
            marks.insert(1, axis.span(tone, 100 * low, 100 * high))
        tip = "; ".join(f"{MEASURES[name][0]} {change(entry, name)}" for name in MEASURES if name in entry)
        rows.append(Strip(called, tuple(marks), f"{signed(100 * success['value'])}", tip))
    legend = (("good", "better"), ("bad", "worse"), ("even", "no difference shown"))
    ends = (f"{signed(axis.low)}", f"{signed(axis.high)} points")
    return [strips(rows, ends, legend, f"Motions followed, change in percentage points, {where}")]


def _value(entry: Json) -> float | None:
    return (entry.get("success") or {}).get("value")
