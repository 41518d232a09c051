"""Meaning of the noise floor, and of an error at or below it.

The floor is no bound: it is the error that a perfect model would show, drawn from simulated sensor noise. It has an
interval of its own, and a measured error may come out below it by chance, or because the sensors are better than said.
"""

from collections.abc import Sequence

from bumblebee.report.charts.residual_chart import value_and_interval
from bumblebee.report.results import Json
from bumblebee.report.wording import plural

WHAT = (
    "Noise floor: the error that sensor noise alone would leave, from the corrected model's own windows with simulated "
    "noise on their start states and readings. It is an estimate with an interval, not a bound: a model as good as the "
    "sensors can show comes out a little above or below it."
)


def meaning(after: Json | None, floor: Json | None) -> str:
    """Meaning of an error beside its floor, as the end of a sentence; "" above the floor's interval or without a floor.

    Args:
        after: `{"value", "ci95"}` of the corrected model's error.
        floor: the same of the noise floor, in the same unit.
    """
    value, _, _ = value_and_interval(after)
    level, low, high = value_and_interval(floor)
    if value != value or level != level:
        return ""
    if low == low and value < low:
        return "less than the floor's interval: the sensors are less noisy than the estimate, or the windows too few"
    if value <= (high if high == high else level):
        return "no more than sensor noise explains"
    return ""


def summary(error: Json, measures: Sequence[str]) -> str:
    """One sentence on how many errors of the corrected model lie below their floor, and below its interval."""
    count, under, below = 0, 0, 0
    for horizon, entries in error.get("after", {}).items():
        for key in measures:
            value, _, _ = value_and_interval(entries.get(key))
            level, low, _ = value_and_interval(error.get("floor", {}).get(horizon, {}).get(key))
            count += value == value and level == level
            under += value < level
            below += value < low
    if not under:
        return ""
    lie = "lies" if under == 1 else "lie"
    told = f"Of the corrected model's {plural(count, 'error')}, {under} {lie} below the floor"
    if not below:
        return f"{told}, within its interval: no more than sensor noise explains."
    return (
        f"{told}, {below} of them below its interval: the sensors are less noisy than the estimate, or the windows few."
    )
