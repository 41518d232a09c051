"""Numbers as a person reads them: rates, errors and changes with their 95 % intervals; and what they allow to say."""

from typing import Any

ALPHA = 0.05
_IRREGULAR = {"policy": "policies"}


def plural(count: int, noun: str) -> str:
    """`1 motion`, `2 motions`."""
    return f"{count} {noun if count == 1 else _IRREGULAR.get(noun, noun + 's')}"


def signed(value: float, digits: int = 0) -> str:
    """`+5`, `−5` with a minus sign as wide as the plus, and `0` without any."""
    words = f"{value:+.{digits}f}"
    return words[1:] if float(words) == 0 else words.replace("-", "\u2212")


def percent(entry: dict[str, Any]) -> str:
    """`{"value", "ci95"}` of a share as `91 % [84, 95]`."""
    if entry.get("value") is None:
        return "–"
    low, high = entry["ci95"]
    return f"{100 * entry['value']:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"


def number(entry: dict[str, Any], digits: int = 3, factor: float = 1.0) -> str:
    """`{"value", "ci95"}` of an error as `0.103 [0.094, 0.112]`; a dash where nothing was measured.

    An error is never negative, so an interval from few motions is cut at 0.
    """
    if entry.get("value") is None:
        return "–"
    low, high = entry["ci95"]
    text = f"{factor * entry['value']:.{digits}f}"
    if low is None or high is None:
        return text
    return f"{text} [{max(factor * low, 0.0):.{digits}f}, {factor * high:.{digits}f}]"


SAME_FILE = "the same file, nothing to compare"
MEASURES = {
    "success": ("success", 100.0, 0, "points", 1),
    "mpjpe_rad": ("MPJPE", 1e3, 1, "mrad", -1),
    "mpkpe_mm": ("MPKPE", 1.0, 1, "mm", -1),
}
"""Key of a paired comparison -> its name, factor to the unit shown, digits, unit, and which sign is better."""


def change(entry: dict[str, Any], measure: str = "success") -> str:
    """A paired difference with its interval and what it shows; success in percentage points.

    Two rates differ by 100 points at most, so an interval from few motions is cut there.
    """
    if entry.get("unchanged"):
        return SAME_FILE
    difference = entry.get(measure) or {}
    if difference.get("value") is None:
        return "not comparable" if measure == "success" else "no episode that both followed"
    _, factor, digits, unit, better = MEASURES[measure]
    words = f"{signed(factor * difference['value'], digits)} {unit}"
    low, high = difference["ci95"]
    if low is None or high is None:
        return f"{words}, too few motions for an interval"
    if difference["value"] == low == high == 0:
        return "the same on every motion: no difference shown"
    if measure == "success":
        low, high = max(low, -1.0), min(high, 1.0)
    p = difference["p"]
    interval = f"[{signed(factor * low, digits)}, {signed(factor * high, digits)}]"
    return f"{words} {interval}, p = {p:.2g}: {shown(low, high, p, better)}"


def changes(entry: dict[str, Any]) -> str:
    """All three differences in one line; one sentence where both are the same file."""
    if entry.get("unchanged"):
        return SAME_FILE
    return "; ".join(f"{MEASURES[m][0]} {change(entry, m)}" for m in MEASURES if m in entry)


def shown(low: float, high: float, p: float, better: int = 1) -> str:
    """Verdict of a difference's interval and the paired test over motions together; few motions can fool either.

    Args:
        low: end of the 95 % interval.
        high: its other end.
        p: of the paired test.
        better: 1 where more is better (success), -1 where less is (errors).
    """
    if p > ALPHA or low <= 0 <= high:
        return "no difference shown"
    return "better" if better * low > 0 else "worse"


def effect_line(effect: dict[str, Any]) -> tuple[str, str, str]:
    """(what and where, value with interval, nominal) of one entry of `effects` in diagnosis.json."""
    places = ", ".join(effect["where"]) or "whole robot"
    values, nominal = [], []
    parameters = effect["parameters"]
    if effect["effect"] == "discovered":
        parameters = {t["term"]: t | {"value": t["coefficient"]} for t in parameters["terms"]}
    for name, parameter in parameters.items():
        low, high = parameter.get("ci95") or (None, None)
        interval = "" if low is None or high is None else f" [{low:.4g}, {high:.4g}]"
        values.append(f"{name} {parameter['value']:.4g}{interval} {parameter.get('unit', '')}".strip())
        nominal.append(f"{parameter['nominal']:.4g}" if parameter.get("nominal") is not None else "–")
    return f"{effect['effect'].replace('_', ' ')} on {places}", "; ".join(values), "; ".join(nominal)
