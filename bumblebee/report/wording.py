"""Numbers as a person reads them: rates, errors and changes with their 95 % intervals; and what they allow to say."""

from typing import Any

ALPHA = 0.05


def percent(entry: dict[str, Any]) -> str:
    """`{"value", "ci95"}` of a share as `91 % [84, 95]`."""
    if entry.get("value") is None:
        return "–"
    low, high = entry["ci95"]
    return f"{100 * entry['value']:.0f} % [{100 * low:.0f}, {100 * high:.0f}]"


def number(entry: dict[str, Any], digits: int = 3, factor: float = 1.0) -> str:
    """`{"value", "ci95"}` as `0.103 [0.094, 0.112]`; a dash where nothing was measured."""
    if entry.get("value") is None:
        return "–"
    low, high = entry["ci95"]
    text = f"{factor * entry['value']:.{digits}f}"
    return text if low is None or high is None else f"{text} [{factor * low:.{digits}f}, {factor * high:.{digits}f}]"


def change(entry: dict[str, Any]) -> str:
    """A difference of rates in points with its interval and what it shows."""
    difference = entry["success"]
    if difference["value"] is None:
        return "not comparable"
    low, high = difference["ci95"]
    points = f"{100 * difference['value']:+.0f} points"
    if low is None or high is None:
        return f"{points}, too few motions for an interval"
    p = difference["p"]
    return f"{points} [{100 * low:+.0f}, {100 * high:+.0f}], p = {p:.2g}: {shown(low, high, p)}"


def shown(low: float, high: float, p: float) -> str:
    """What a gain's interval and the paired test over motions show together; few motions can fool either."""
    if p > ALPHA or low <= 0 <= high:
        return "no difference shown"
    return "improved" if low > 0 else "worse"


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
