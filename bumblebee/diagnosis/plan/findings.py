"""Findings of a diagnosis: effects with intervals, and those that its data could not tell from them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bumblebee.diagnosis.simulation import Plant
from bumblebee.errors import BadInput
from bumblebee.io.read import read_json
from bumblebee.sim.effects import CATALOGUE, Effect, read_effects


@dataclass(frozen=True, eq=False)
class Finding:
    """One effect of the list in `diagnosis.json`."""

    found: Effect
    """As `effects.yaml` has it."""
    low: dict[str, float | None]
    """Parameter -> lower end of its interval; None for no end."""
    high: dict[str, float | None]
    nominal: dict[str, float | None]
    """Parameter -> declared value; None where the model knows no bound."""
    equivalent: tuple[tuple[str, str], ...]
    """(effect, place) that the data could not tell from it; place "" for the whole robot."""

    @property
    def where(self) -> str:
        """Its joint, body or geometry; "" for the whole robot."""
        return self.found.where[0] if self.found.where else ""

    @property
    def name(self) -> str:
        """Effect and place, in words."""
        return f"{self.found.effect.replace('_', ' ')} {self.where}".strip()

    def _change(self, parameter: str) -> tuple[float, float]:
        """Value of a parameter, and how far it is from the declared one."""
        value = self.found.parameters[parameter]
        return value, abs(value - (self.nominal.get(parameter) or 0.0))

    def differs(self, other: Effect, share: float) -> bool:
        """Whether an effect of this kind is another robot: a parameter differs by more than that share."""
        changes = {name: self._change(name) for name in self.found.parameters}
        return any(abs(other.parameters[name] - value) > share * change for name, (value, change) in changes.items())

    def ends(self, beyond: float) -> list[tuple[str, Effect]]:
        """The effect with one parameter at either end of its interval, and which.

        The first parameter's interval without an end: as far as `beyond` times the change from the declared value.
        """
        ends = []
        for k, parameter in enumerate(CATALOGUE[self.found.effect].parameters):
            if parameter.name not in self.found.parameters:
                continue
            value, change = self._change(parameter.name)
            for name, side, sign in (("lower", self.low, -1.0), ("upper", self.high, 1.0)):
                end = side.get(parameter.name)
                if end is None and k:
                    continue
                end = value + sign * (beyond - 1.0) * change if end is None else end
                inside = float(np.clip(end, parameter.lower, parameter.upper))
                changed = Effect(self.found.effect, self.found.where, {**self.found.parameters, parameter.name: inside})
                ends.append((f"{name} end of its {'interval' if not k else parameter.name}", changed))
        return ends


@dataclass(frozen=True, eq=False)
class Findings:
    """Findings of one diagnosis."""

    effects: tuple[Effect, ...]
    """All that the corrected model has."""
    listed: tuple[Finding, ...]
    """Those of the catalogue, in the order of the list."""


def findings_of(document: Mapping[str, Any], effects: Sequence[Effect], where: object = "diagnosis") -> Findings:
    """The findings of a document and the effects that go with it."""
    listed, left = [], list(effects)
    for k, entry in enumerate(_entries(document, where)):
        name, places = entry["effect"], tuple(entry["where"])
        match = next((e for e in left if e.effect == name and e.where == places), None)
        if match is None or not CATALOGUE[name].parameters or not match.parameters:
            continue
        left.remove(match)
        listed.append(_finding(entry, match, f"{where}: effects[{k}]"))
    return Findings(tuple(effects), tuple(listed))


def read_findings(folder: Path) -> Findings:
    """The findings of a folder that `bumblebee diagnose` wrote."""
    document = Path(folder) / "diagnosis.json"
    if not document.is_file():
        raise BadInput(
            document, "a diagnosis of this dataset", "no such file",
            "Run `bumblebee diagnose MODEL.xml DATASET --out FOUND` first, then plan with --diagnosis FOUND.",
        )  # fmt: skip
    content = read_json(document)
    if not isinstance(content, dict) or content.get("schema") != 1:
        raise BadInput(document, "a diagnosis of schema 1", "something else")
    effects = read_effects(Path(folder) / "effects.yaml")
    return findings_of(content, effects, document)


def refuse_strange(findings: Findings, plant: Plant) -> None:
    """`BadInput` for an effect on a place that the model does not have."""
    model = plant.model
    geoms = {model.geom(g).name for g in range(model.ngeom)}
    names = {"joint": set(plant.joints), "body": set(plant.bodies), "geom": geoms, "whole": set()}
    for effect in findings.effects:
        kind = CATALOGUE[effect.effect].on
        for place in effect.where:
            if place not in names[kind]:
                where = f"diagnosis: effect {effect.effect}"
                raise BadInput(where, f"a {kind} of the model", repr(place)[:80], "Plan with the model it is of.")


def _entries(document: Mapping[str, Any], where: object) -> list[dict[str, Any]]:
    entries = document.get("effects")
    if not isinstance(entries, list):
        raise BadInput(f"{where}: effects", "a list", type(entries).__name__)
    for k, entry in enumerate(entries):
        if not _is_label(entry):
            raise BadInput(f"{where}: effects[{k}]", "an effect of the catalogue with its place", repr(entry)[:80])
    return entries


def _is_label(entry: object) -> bool:
    return (
        isinstance(entry, dict)
        and entry.get("effect") in CATALOGUE
        and isinstance(entry.get("where"), list)
        and all(isinstance(name, str) for name in entry["where"])
    )


def _finding(entry: dict[str, Any], match: Effect, where: str) -> Finding:
    low, high, nominal = {}, {}, {}
    table = entry.get("parameters")
    for name, given in (table if isinstance(table, dict) else {}).items():
        if name not in match.parameters:
            continue
        ends = given.get("ci95") if isinstance(given, dict) else None
        if not (isinstance(ends, list) and len(ends) == 2 and all(map(_is_end, [*ends, given.get("nominal")]))):
            raise BadInput(f"{where}: {name}", "ci95 of two numbers or null, and nominal", repr(given)[:80])
        low[name], high[name], nominal[name] = ends[0], ends[1], given.get("nominal")
    same = entry.get("equivalent", [])
    if not (isinstance(same, list) and all(map(_is_label, same))):
        raise BadInput(f"{where}: equivalent", "a list of effects", repr(same)[:80])
    others = tuple((o["effect"], o["where"][0] if o["where"] else "") for o in same)
    return Finding(match, low, high, nominal, others)


def _is_end(value: object) -> bool:
    return value is None or (
        isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))
    )
