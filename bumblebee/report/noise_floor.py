"""What the noise floor is, and what an error at or below it means.

The floor is no bound: it is the error that a perfect model would show, drawn from simulated sensor noise. It has an
interval of its own, and a measured error may come out below it by chance, or because the sensors are better than said.
"""

from bumblebee.report.residual_figure import value_and_interval
from bumblebee.report.results import Json
from bumblebee.report.wording import plural

WHAT = (
    "Noise floor: the error that sensor noise alone would leave, from the corrected model's own windows with simulated "
    "noise on their start states and readings. It is an estimate with an interval, not a bound: a model as good as the "
    "sensors can show comes out a little above or below it."
)


def meaning(after: Json | None, floor: Json | None) -> str:
    """What an error says beside its floor, as the end of a sentence; "" above the floor's interval or without a floor.

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


def summary(error: Json, measures: dict[str, tuple[str, float, str]]) -> tuple[str, list[str]]:
    """How many errors of the corrected model lie below their floor, and a line for each one below its interval.

    Args:
        error: the diagnosis' error block.
        measures: key -> (name, factor to the unit shown, unit).
    """
    count, under, lines = 0, 0, []
    for horizon, entries in error.get("after", {}).items():
        for key, (name, factor, unit) in measures.items():
            (value, _, _), floor = (
                value_and_interval(entries.get(key)),
                error.get("floor", {}).get(horizon, {}).get(key),
            )
            level, low, high = value_and_interval(floor)
            count += value == value and level == level
            under += value < level
            if value < low:
                numbers = f"{factor * value:.3g} {unit} against {factor * level:.3g}"
                interval = f"[{factor * low:.3g}, {factor * high:.3g}]"
                lines.append(f"{name} after {horizon} s, {numbers} {interval}: {meaning(entries[key], floor)}")
    if not under:
        return "", []
    inside = f"{under - len(lines)} of them within its interval (no more than sensor noise explains)."
    lie = "lies" if under == 1 else "lie"
    return f"Of the corrected model's {plural(count, 'error')}, {under} {lie} below the floor, {inside}", lines
