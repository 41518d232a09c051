"""The sealed effects beside what the diagnosis found: matched, missed, or reported without being there."""

from dataclasses import dataclass
from typing import Any

Json = dict[str, Any]


@dataclass(frozen=True)
class Match:
    """One row: a sealed effect with what was found for it, or one of both alone."""

    sealed: Json | None
    found: Json | None
    through: str = ""
    """"exact", or "class" where the data cannot tell the found effect from the sealed one."""

    @property
    def relative_error(self) -> float | None:
        """(found - sealed) / sealed of the parameter, where both name the same one."""
        if self.sealed is None or self.found is None or self.through != "exact":
            return None
        name, truth = next(iter(self.sealed["parameters"].items()))
        parameter = self.found["parameters"].get(name)
        return None if parameter is None or truth == 0 else float(parameter["value"]) / float(truth) - 1.0

    @property
    def covered(self) -> bool | None:
        """Whether the 95 % interval holds the sealed value."""
        if self.sealed is None or self.found is None or self.relative_error is None:
            return None
        name, truth = next(iter(self.sealed["parameters"].items()))
        low, high = self.found["parameters"][name].get("ci95") or (None, None)
        return None if low is None or high is None else bool(low <= truth <= high)


def match(sealed: list[Json], found: list[Json]) -> list[Match]:
    """Pair sealed and found effects: same effect on the same place first, then by the found effect's class."""
    left, rows = list(found), []
    for truth in sealed:
        exact = next((f for f in left if _same(f, truth)), None)
        close = next((f for f in left if any(_same(e, truth) for e in f.get("equivalent", []))), None)
        hit = exact or close
        if hit is not None:
            left.remove(hit)
        rows.append(Match(truth, hit, "" if hit is None else "exact" if hit is exact else "class"))
    return rows + [Match(None, extra) for extra in left]


def _same(a: Json, b: Json) -> bool:
    return a["effect"] == b["effect"] and set(a["where"]) == set(b["where"])
