"""`effects.yaml`: effects written and read; what is read is the catalogue's, within bounds, or refused."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from bumblebee.effects.catalogue import CATALOGUE, Effect
from bumblebee.effects.kind import Parameter
from bumblebee.effects.terms import read_term
from bumblebee.effects.units import both_units
from bumblebee.errors import BadInput
from bumblebee.io.limits import Limits
from bumblebee.io.read import read_yaml
from bumblebee.io.write import write_file

_LIMITS = Limits(text_bytes=1 << 20, nodes=30_000)
_MOST = 2000  # effects of a file: a robot has some dozens of joints, the catalogue some dozens of effects
_LONGEST = 200  # characters of a joint's name
_LARGEST = 1e9  # of a parameter or a coefficient, in SI units


def write_effects(path: Path, effects: Sequence[Effect]) -> None:
    """Write `effects.yaml`; it appears whole or not at all."""
    write_file(path, effects_yaml(effects))


def effects_yaml(effects: Sequence[Effect]) -> str:
    """The text of `effects.yaml`."""
    entries = [{"effect": e.effect, "where": list(e.where), "parameters": _written(e)} for e in effects]
    return yaml.safe_dump({"schema": 1, "effects": entries}, sort_keys=False)


def read_effects(path: Path) -> list[Effect]:
    """Read `effects.yaml`; a key, an id or a value that is not the catalogue's is named in a `BadInput`."""
    document = read_yaml(Path(path), _LIMITS)
    _only_keys(path, document, {"schema", "effects"})
    if type(document.get("schema")) is not int or document["schema"] != 1:
        raise BadInput(f"{path}: schema", "1", repr(document.get("schema"))[:80])
    entries = document.get("effects")
    if not isinstance(entries, list):
        raise BadInput(f"{path}: effects", "a list", type(entries).__name__)
    if len(entries) > _MOST:
        raise BadInput(f"{path}: effects", f"at most {_MOST:,} effects", f"{len(entries):,}")
    effects = [_effect(f"{path}: effects[{i}]", entry) for i, entry in enumerate(entries)]
    for i, effect in enumerate(effects):
        if effect in effects[:i]:
            first = effects.index(effect)
            raise BadInput(f"{path}: effects[{i}]", "each effect once", f"the same as effects[{first}]")
    return effects


def _written(effect: Effect) -> dict[str, Any]:
    if effect.effect != "discovered":
        return dict(effect.parameters)
    return {"terms": [{"term": term, "coefficient": value} for term, value in effect.parameters.items()]}


def _only_keys(where: object, table: Any, keys: set[str]) -> None:
    if not isinstance(table, dict):
        raise BadInput(where, f"a mapping with keys {sorted(keys)}", type(table).__name__)
    if unknown := sorted(str(key) for key in table if key not in keys):
        raise BadInput(where, f"only the keys {sorted(keys)}", f"unknown key {unknown[0][:80]!r}")


def _effect(where: str, entry: Any) -> Effect:
    _only_keys(where, entry, {"effect", "where", "parameters"})
    name = entry.get("effect")
    if not isinstance(name, str) or name not in CATALOGUE:
        raise BadInput(f"{where}: effect", f"one of {sorted(CATALOGUE)}", repr(name)[:80])
    kind, places = CATALOGUE[name], entry.get("where")
    every = kind.whole or kind.on == "whole"
    if not isinstance(places, list) or (not places and not every) or not all(isinstance(p, str) for p in places):
        raise BadInput(f"{where}: where", f"a list of {kind.on} names", repr(places)[:80])
    for place in places:
        if not 0 < len(place) <= _LONGEST:
            raise BadInput(f"{where}: where", f"names of 1 to {_LONGEST} characters", f"{len(place):,}")
    if len(set(places)) != len(places):
        twice = next(place for place in places if places.count(place) > 1)
        raise BadInput(f"{where}: where", f"each {kind.on} once", f"{twice[:80]!r} twice")
    if name == "discovered":
        return Effect(name, tuple(places), _terms(f"{where}: parameters", entry.get("parameters")))
    _only_keys(f"{where}: parameters", entry.get("parameters"), set(kind.names))
    given = entry["parameters"]
    wanted = [p for p in kind.parameters if p.default is None or p.name in given]
    values = {p.name: _value(where, given.get(p.name), p, kind.on == "joint") for p in wanted}
    return Effect(name, tuple(places), values)


def _terms(where: str, table: Any) -> dict[str, float]:
    """Term -> coefficient of a discovered effect; a formula that cannot be read is a `BadInput`."""
    _only_keys(where, table, {"terms"})
    terms = table.get("terms")
    if not isinstance(terms, list) or not terms:
        raise BadInput(f"{where}.terms", "a list of term and coefficient", repr(terms)[:80])
    out = {}
    for i, entry in enumerate(terms):
        _only_keys(f"{where}.terms[{i}]", entry, {"term", "coefficient"})
        value, term = entry.get("coefficient"), entry.get("term")
        if not _is_number(value):
            raise BadInput(f"{where}.terms[{i}].coefficient", f"a number of at most {_LARGEST:g}", _shown(value))
        if not isinstance(term, str):
            raise BadInput(f"{where}.terms[{i}].term", "a formula", _shown(term))
        try:
            text = read_term(term).text
        except BadInput as error:
            raise BadInput(f"{where}.terms[{i}].term", error.expected, f"{term[:60]!r}: {error.came}") from None
        if text in out:
            raise BadInput(f"{where}.terms[{i}].term", "each term once", f"{text[:60]!r} twice")
        out[text] = float(value)
    return out


def _value(where: str, value: Any, parameter: Parameter, on_joint: bool) -> float:
    """A finite number within the parameter's bounds."""
    if not _is_number(value) or not parameter.lower <= value <= parameter.upper:
        unit = both_units(parameter.unit) if on_joint else parameter.unit
        lower, upper = max(parameter.lower, -_LARGEST), min(parameter.upper, _LARGEST)
        expected = f"a number from {lower:g} to {upper:g} {unit}".strip()
        raise BadInput(f"{where}: parameters.{parameter.name}", expected, _shown(value))
    return float(value)


def _is_number(value: Any) -> bool:
    """A number that physics can have: neither NaN nor infinite nor beyond `_LARGEST`."""
    return isinstance(value, int | float) and not isinstance(value, bool) and -_LARGEST <= value <= _LARGEST


def _shown(value: Any) -> str:
    large = isinstance(value, int) and abs(value) > _LARGEST
    return "a larger number" if large else repr(value)[:80]
