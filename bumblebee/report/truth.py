"""The sealed effects beside what the diagnosis found: matched, missed, or reported without being there."""

from dataclasses import dataclass
from typing import Any

from bumblebee.report.wording import signed

Json = dict[str, Any]


@dataclass(frozen=True)
class Match:
    """One row: a sealed effect with what was found for it, or one of both alone."""

    sealed: Json | None
    found: Json | None
    through: str = ""
    """"exact"; "class" where the data cannot tell the found effect from the sealed one; "form" where a law without a
    name was found at the sealed place."""

    @property
    def relative_error(self) -> float | None:
        """(found - sealed) / sealed of the parameter, where both name the same one."""
        if self.sealed is None or self.found is None or self.through != "exact":
            return None
        name, truth = next(iter(self.sealed["parameters"].items()))
        parameter = self.found["parameters"].get(name)
        return None if parameter is None or truth == 0 else float(parameter["value"]) / float(truth) - 1.0

    @property
    def covered(self) -> dict[str, bool]:
        """By parameter whether the 95 % interval holds the sealed value, where it has two ends."""
        if self.sealed is None or self.found is None or self.relative_error is None:
            return {}
        sealed, found = self.sealed["parameters"], self.found["parameters"]
        ends = {name: found[name].get("ci95") or (None, None) for name in sealed if name in found}
        return {
            name: bool(low <= sealed[name] <= high) for name, (low, high) in ends.items() if None not in (low, high)
        }

    @property
    def told(self) -> str:
        """By how much the first parameter is off, and what the intervals hold; empty where the truth is not known."""
        if self.relative_error is None:
            return ""
        outside = [name for name, holds in self.covered.items() if not holds]
        held = ", interval holds it" if self.covered else ""
        missed = ", outside the interval" if len(self.covered) == 1 else f", {', '.join(outside)} outside the interval"
        return f" ({signed(100 * self.relative_error, 1)} %{missed if outside else held})"


def match(sealed: list[Json], found: list[Json]) -> list[Match]:
    """Pair sealed and found effects: the same effect and place first, then its class, then a discovered form there."""
    left, rows = list(found), []
    for truth in sealed:
        exact = next((f for f in left if _same(f, truth)), None)
        close = next((f for f in left if any(_same(e, truth) for e in f.get("equivalent", []))), None)
        form = next((f for f in left if f["effect"] == "discovered" and _there(f, truth)), None)
        hit = exact or close or form
        if hit is not None:
            left.remove(hit)
        rows.append(Match(truth, hit, _through(hit, exact, close)))
    return rows + [Match(None, extra) for extra in left]


def hits(sealed: list[Json], found: list[Json]) -> tuple[int, int, int]:
    """(sealed and found, sealed, found but not sealed)."""
    rows = match(sealed, found)
    count = sum(1 for row in rows if row.sealed is not None and row.found is not None)
    return count, len(sealed), sum(1 for row in rows if row.sealed is None)


def _through(hit: Json | None, exact: Json | None, close: Json | None) -> str:
    return "" if hit is None else "exact" if hit is exact else "class" if hit is close else "form"


def _there(a: Json, b: Json) -> bool:
    return not b["where"] or bool(set(a["where"]) & set(b["where"]))


def _same(a: Json, b: Json) -> bool:
    return a["effect"] == b["effect"] and set(a["where"]) == set(b["where"])
