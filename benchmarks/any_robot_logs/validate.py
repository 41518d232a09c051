"""Whether a diagnosis.json is what the contract says: keys, kinds, finite numbers, intervals in order."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from bumblebee.sim.effects import CATALOGUE

_TOP = {
    "schema": int, "train": list, "holdout": list, "accept": list, "effects": list, "unexplained": dict, "error": dict,
    "units": dict, "unidentifiable": list, "smallest_detectable": list, "set_aside": list, "notes": list,
    "warnings": list, "settings": dict,
}  # fmt: skip
_EFFECT = {
    "effect": str, "where": list, "parameters": (dict, list), "equivalent": list, "explains": (int, float, type(None)),
    "evidence": dict, "native": bool,
}  # fmt: skip
_UNEXPLAINED = {"significant": bool, "p": (int, float), "where": list, "depends_on": list, "description": str}
_HORIZONS = ("0.02", "0.2", "1.0")


def problems(document: Any) -> list[str]:
    """Faults of a document, one line each; empty where it keeps the contract."""
    found = [*_keys(document, _TOP, "document")]
    if found:
        return found
    if document["schema"] != 1:
        found.append(f"schema: {document['schema']!r}, not 1")
    if not document["train"] or not all(isinstance(i, str) for i in document["train"] + document["holdout"]):
        found.append("train, holdout: ids of rollouts")
    if set(document["train"]) & set(document["holdout"]):
        found.append("a rollout is in train and in holdout")
    for k, entry in enumerate(document["effects"]):
        found += _effect(entry, f"effects[{k}]")
    found += _unexplained(document["unexplained"])
    for part in ("before", "after", "floor"):
        found += _errors(document["error"].get(part), f"error.{part}")
    found += [f"{key}: lines of text" for key in ("notes", "warnings") if not all(map(_line, document[key]))]
    return [*found, *(f"{path}: {value}, no finite number" for path, value in _unbounded(document, ""))]


def _keys(entry: Any, wanted: Mapping[str, Any], where: str) -> Iterator[str]:
    if not isinstance(entry, Mapping):
        yield f"{where}: no object"
        return
    for key, kind in wanted.items():
        if key not in entry:
            yield f"{where}: no key {key!r}"
        elif not isinstance(entry[key], kind):
            yield f"{where}.{key}: {type(entry[key]).__name__}"


def _line(text: Any) -> bool:
    return isinstance(text, str) and bool(text.strip()) and "\n" not in text


def _effect(entry: Any, where: str) -> list[str]:
    found = [*_keys(entry, _EFFECT, where)]
    if found:
        return found
    if entry["effect"] not in CATALOGUE:
        found.append(f"{where}: {entry['effect']!r} is no effect of the contract")
    parameters = entry["parameters"].items() if isinstance(entry["parameters"], dict) else []
    for name, parameter in parameters:
        if isinstance(parameter, Mapping) and "value" in parameter:
            found += _interval(parameter, f"{where}.{name}", around=True)
    share = entry["explains"]
    if share is not None and not -1e-9 <= share <= 1 + 1e-9:
        found.append(f"{where}.explains: {share}")
    return found


def _interval(entry: Mapping[str, Any], where: str, around: bool = False) -> list[str]:
    """A `ci95` is two numbers in order; `around`: with the value between them."""
    ends, value = entry.get("ci95"), entry.get("value")
    if ends is None:
        return []
    if not isinstance(ends, list) or len(ends) != 2:
        return [f"{where}.ci95: {ends!r}"]
    if any(e is None for e in ends):
        return []
    slack = 1e-9 * (1 + abs(value or 0.0))
    if ends[0] > ends[1]:
        return [f"{where}.ci95: {ends} out of order"]
    if around and value is not None and not ends[0] - slack <= value <= ends[1] + slack:
        return [f"{where}: {value} outside of {ends}"]
    return []


def _unexplained(entry: Any) -> list[str]:
    found = [*_keys(entry, _UNEXPLAINED, "unexplained")]
    if not found and not 0 <= entry["p"] <= 1:
        found.append(f"unexplained.p: {entry['p']}")
    return found


def _errors(block: Any, where: str) -> list[str]:
    if not isinstance(block, Mapping):
        return [f"{where}: no object"]
    found = [f"{where}: horizon {h!r}" for h in block if h not in _HORIZONS]
    for horizon, measures in block.items():
        for path, entry in _measures(measures, f"{where}.{horizon}"):
            found += _interval(entry, path)
            if entry["value"] is not None and entry["value"] < 0:
                found.append(f"{path}: {entry['value']}")
    return found


def _measures(entry: Any, path: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Everything with a value."""
    if isinstance(entry, Mapping):
        if "value" in entry:
            yield path, entry
        for key, inner in entry.items():
            yield from _measures(inner, f"{path}.{key}")


def _unbounded(entry: Any, path: str) -> Iterator[tuple[str, float]]:
    """Numbers that are none."""
    if isinstance(entry, Mapping):
        for key, inner in entry.items():
            yield from _unbounded(inner, f"{path}.{key}")
    elif isinstance(entry, list):
        for k, inner in enumerate(entry):
            yield from _unbounded(inner, f"{path}[{k}]")
    elif isinstance(entry, float) and not math.isfinite(entry):
        yield path.lstrip("."), entry
