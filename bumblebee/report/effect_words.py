"""An effect in few words: its name, its place and its size with unit, as sealed and as found."""

from collections.abc import Sequence
from itertools import zip_longest
from typing import Any

from bumblebee.report.charts.figures import short_joint
from bumblebee.sim.effects import CATALOGUE

Json = dict[str, Any]
_MOST_PLACES = 3


def outside(effect: Json) -> bool:
    """Whether the catalogue has no such effect, so that no diagnosis can name it."""
    return effect["effect"] not in CATALOGUE


def named(effect: Json) -> str:
    """`coulomb friction, L knee`."""
    if effect["effect"] == "discovered":
        return f"a law without a name, {places(effect['where'])}"
    return f"{effect['effect'].replace('_', ' ')}, {places(effect.get('where', []))}"


def places(where: Sequence[str]) -> str:
    """Joints and bodies in short; their number where there are many."""
    if len(where) > _MOST_PLACES:
        return f"{len(where)} places"
    return ", ".join(map(short_joint, where)) or "whole robot"


def sealed_size(effect: Json) -> str:
    """The sealed values with their units: the catalogue's, else those of the seal ("N m, rad") in order."""
    kind = CATALOGUE.get(effect["effect"])
    known = {p.name: p.unit for p in kind.parameters} if kind else {}
    given = str(effect.get("unit", "")).split(", ")
    units = [known.get(name, unit) for name, unit in zip_longest(effect["parameters"], given, fillvalue="")]
    rows = zip(effect["parameters"].items(), units, strict=False)
    return _joined([(name, _number(value), unit) for (name, value), unit in rows])


def found_size(effect: Json) -> str:
    """The found values with their 95 % intervals and units; the terms of a form that was discovered."""
    parameters = effect["parameters"]
    if effect["effect"] == "discovered":
        terms = [f"{_with_interval(t['coefficient'], t.get('ci95'))} × {t['term']}" for t in parameters["terms"]]
        return " + ".join(terms)
    return _joined(
        [(name, _with_interval(p["value"], p.get("ci95")), p.get("unit", "")) for name, p in parameters.items()]
    )


def _with_interval(value: float, ci95: Sequence[float | None] | None) -> str:
    low, high = ci95 or (None, None)
    interval = "" if low is None or high is None else f" [{_number(low)}, {_number(high)}]"
    return _number(value) + interval


def _joined(parts: list[tuple[str, str, str]]) -> str:
    """A lone value with a unit needs no name; a factor, and one of several, does."""
    if len(parts) == 1 and parts[0][2]:
        return _tied(*parts[0][1:])
    return ", ".join(f"{name} {_tied(value, unit)}" for name, value, unit in parts)


def _tied(value: str, unit: str) -> str:
    """A value with its unit, which no line break parts from it."""
    return f"{value}\u00a0{unit}".replace("N m", "N\u00a0m") if unit else value


def _number(value: Any) -> str:
    return f"{value:.3g}".replace("-", "\u2212") if isinstance(value, int | float) else str(value)
