"""Effects that a model may lack: one import for the catalogue, `effects.yaml`, native MJCF and runtime hooks.

Values are absolute (N m, kg, s, rad ...), so that the effects applied to the declared model *are* the corrected
model; `motor_strength`, `kp` and `kd` alone are factors on the declared gains.
"""

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from bumblebee.errors import BadInput
from bumblebee.sim.effect_catalogue import CATALOGUE, Effect, Kind, Parameter, single
from bumblebee.sim.effect_hooks import RuntimeHooks, runtime_hooks
from bumblebee.sim.effect_spec import add_to_spec
from bumblebee.sim.effect_terms import read_term
from bumblebee.sim.units import both_units

__all__ = [
    "CATALOGUE",
    "Effect",
    "Kind",
    "RuntimeHooks",
    "add_to_spec",
    "effects_yaml",
    "read_effects",
    "runtime_hooks",
    "single",
    "write_effects",
]


def write_effects(path: Path, effects: Sequence[Effect]) -> None:
    """Write `effects.yaml`; it appears whole or not at all."""
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    temporary.write_text(effects_yaml(effects))
    os.replace(temporary, path)


def effects_yaml(effects: Sequence[Effect]) -> str:
    """The text of `effects.yaml`."""
    entries = [{"effect": e.effect, "where": list(e.where), "parameters": _written(e)} for e in effects]
    return yaml.safe_dump({"schema": 1, "effects": entries}, sort_keys=False)


def read_effects(path: Path) -> list[Effect]:
    """Read `effects.yaml`; a key, an id or a value that is not the catalogue's is named in a `BadInput`."""
    try:
        document = yaml.safe_load(Path(path).read_text())
    except FileNotFoundError:
        raise BadInput(path, "an effects file", "no such file") from None
    except (yaml.YAMLError, UnicodeDecodeError, OSError) as error:
        raise BadInput(
            path, "YAML of plain values", type(error).__name__, "Write it with `bumblebee diagnose`."
        ) from None
    _only_keys(path, document, {"schema", "effects"})
    if document.get("schema") != 1:
        raise BadInput(f"{path}: schema", "1", repr(document.get("schema")))
    entries = document.get("effects")
    if not isinstance(entries, list):
        raise BadInput(f"{path}: effects", "a list", type(entries).__name__)
    return [_effect(f"{path}: effects[{i}]", entry) for i, entry in enumerate(entries)]


def _written(effect: Effect) -> dict[str, Any]:
    if effect.effect != "discovered":
        return dict(effect.parameters)
    return {"terms": [{"term": term, "coefficient": value} for term, value in effect.parameters.items()]}


def _only_keys(where: object, table: Any, keys: set[str]) -> None:
    if not isinstance(table, dict):
        raise BadInput(where, f"a mapping with keys {sorted(keys)}", type(table).__name__)
    if unknown := sorted(str(key) for key in table if key not in keys):
        raise BadInput(where, f"only the keys {sorted(keys)}", f"unknown key {unknown[0]!r}")


def _effect(where: str, entry: Any) -> Effect:
    _only_keys(where, entry, {"effect", "where", "parameters"})
    name = entry.get("effect")
    if not isinstance(name, str) or name not in CATALOGUE:
        raise BadInput(f"{where}: effect", f"one of {sorted(CATALOGUE)}", repr(name)[:80])
    kind, places = CATALOGUE[name], entry.get("where")
    every = kind.whole or kind.on == "whole"
    if not isinstance(places, list) or (not places and not every) or not all(isinstance(p, str) for p in places):
        raise BadInput(f"{where}: where", f"a list of {kind.on} names", repr(places)[:80])
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
        value = entry.get("coefficient")
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise BadInput(f"{where}.terms[{i}].coefficient", "a finite number", repr(value)[:80])
        out[read_term(str(entry.get("term"))).text] = float(value)
    return out


def _value(where: str, value: Any, parameter: Parameter, on_joint: bool) -> float:
    """A finite number within the parameter's bounds."""
    number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if not number or not parameter.lower <= value <= parameter.upper:
        unit = both_units(parameter.unit) if on_joint else parameter.unit
        expected = f"a number from {parameter.lower:g} to {parameter.upper:g} {unit}".strip()
        raise BadInput(f"{where}: parameters.{parameter.name}", expected, repr(value)[:80])
    return float(value)
